// SPDX-License-Identifier: Apache-2.0
#include "explain/explainer.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <tuple>
#include <utility>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::explain {

System::System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& graph_tasks,
               results::RunKind run_kind, unsigned cores)
    : tasks(graph_tasks),
      kind(run_kind),
      simulated(kind == results::RunKind::simulated),
      delivery(simulated ? graph.platform.delivery_delay : Duration{}),
      wall_clock_work(graph.work == WorkMode::wall),
      chains(index_chains(graph, tasks)),
      cores_(cores >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << cores) - 1),
      spec_(spec) {
  std::optional<simulated::System> simulation;
  if (simulated) simulation.emplace(spec, graph, tasks);
  for (const setup::ExecutorSpec& part : setup::parts(spec)) {
    const ExecutorTraits& traits = part.entry->traits;
    ServingExecutor& executor = executors_.emplace_back(
        ServingExecutor{traits, part.scheduler.service_wait, part.first_worker, job_threads(part)});
    if (traits.family == Family::priority_events)
      executor.order.emplace(tasks.set, *traits.policy, part.scheduler.rule, part.scheduler.ties);
    if (!simulation) continue;
    const SimulatedExecutor& of = simulation->executors()[executors_.size() - 1];
    threads_.insert(threads_.end(), of.threads.begin(), of.threads.end());
    const Platform p = make_platform(graph, *part.entry);
    if (traits.timers == TimerHandling::release_only) executor.second_wake_up = p.wake_up_latency;
    const auto releases = static_cast<std::int64_t>(tasks.set.size());
    executor.most_overhead = p.wake_up_latency + p.wait_cost +
                             (releases + of.other_entities) * p.wait_cost_per_entity +
                             p.longest_dispatch_cost() + p.pass_cost + releases * p.release_cost;
  }
}

unsigned System::cores_of(std::size_t worker) const {
  const std::uint64_t allowed = worker < threads_.size() ? threads_[worker].processors : ~std::uint64_t{0};
  return static_cast<unsigned>(std::popcount(allowed & cores_));
}

bool System::outranks(std::size_t other, Time other_start, std::size_t worker, Time since) const {
  if (std::max(other, worker) >= threads_.size()) return other_start > since;
  const SimulatedThread &a = threads_[other], &b = threads_[worker];
  if ((a.processors & b.processors & cores_) == 0) return false;
  return a.priority != b.priority ? a.priority > b.priority : other_start > since;
}

bool System::share_group(TaskId a, TaskId b) const {
  const std::uint32_t group = task(a).group;
  return group == task(b).group && tasks.set.groups[group] == CallbackGroup::mutually_exclusive &&
         &executor_of(a) == &executor_of(b) &&
         executor_of(a).traits.timers != TimerHandling::release_and_execute;
}

namespace {

auto key_of(const Output& o) { return std::tuple(o.repetition, o.sink, o.sequence); }

/// The waits in an explanation of a latency that begins at `at`, each from when others ran on.
std::vector<ThreadsInWait> waits_of(const System& system, const JobWindow& window, const Explanation& e,
                                    Time at) {
  std::vector<ThreadsInWait> waits;
  for (const Part& part : e.parts) {
    const Time from = std::exchange(at, at + part.length);
    const JobRecord& waiting = e.path[part.step];
    const ServingExecutor& executor = system.executor_of(waiting.job.task);
    const bool for_others = part.behind.task != kNoTask || part.cause == Cause::snapshot;
    const bool known = !waits.empty() && waits.back().step == part.step;
    if (!executor.many_threads() || !for_others || known || from >= waiting.start) continue;
    ThreadsInWait& wait = waits.emplace_back(ThreadsInWait{part.step, from, waiting.start, {}});
    for (std::size_t w = executor.first_worker; w < executor.first_worker + executor.threads; ++w) {
      std::vector<ThreadsInWait::Ran>& ran = wait.threads[w];
      for (const Seen* seen : window.of_worker(w, from, waiting.start)) {
        const JobRecord& r = seen->record;
        if (r.finish == r.start) continue;
        ran.push_back({r.job.ref(), r.start, r.finish, system.share_group(r.job.task, waiting.job.task)});
      }
    }
  }
  return waits;
}

}  // namespace

const Output& at_quantile(const std::vector<Output>& by_latency, double quantile) {
  return by_latency[nearest_rank(by_latency.size(), quantile)];
}

std::vector<Output> sorted_by_latency(std::vector<Output> outputs) {
  std::ranges::stable_sort(outputs, {}, &Output::latency);
  return outputs;
}

Explainer::Explainer(const System& system, std::optional<std::uint32_t> chain, std::vector<Output> outputs,
                     Use use, Latency latency)
    : system_(system),
      chain_(chain ? &system.chains[*chain] : nullptr),
      latency_(chain ? latency : Latency::response),
      outputs_(std::move(outputs)),
      use_(std::move(use)),
      window_(system.tasks.set.size()),
      paths_(system, window_, chain_) {
  std::ranges::sort(outputs_, {}, key_of);
  for (const Output& output : outputs_) longest_ = std::max(longest_, output.latency);
}

void Explainer::begin(std::uint32_t repetition, const ExecutionTimes* times) {
  repetition_ = repetition;
  times_ = times;
  window_.clear();
  paths_.clear();
  now_ = Time::min();
}

void Explainer::add(const JobRecord& record) {
  if (!record.started()) return;
  now_ = record.start;
  explain_finished();
  constexpr std::size_t kBetween = 1024;  // jobs between two clean-ups
  if (++added_ % kBetween == 0) {
    Time first = now_;
    for (const auto& [job, latency] : unfinished_) first = std::min(first, job.record.start);
    window_.forget_before(first - longest_);
  }
  const Seen& seen = window_.add(record);
  paths_.add(seen);
  const std::tuple key(repetition_, record.job.task, record.job.sequence);
  const auto output = std::ranges::lower_bound(outputs_, key, {}, key_of);
  if (output != outputs_.end() && key_of(*output) == key) unfinished_.emplace_back(seen, output->latency);
}

void Explainer::end() {
  now_ = kNever;
  explain_finished();
}

void Explainer::explain_finished() {
  const auto finish = [](const auto& output) { return output.first.record.finish; };
  if (unfinished_.size() > 1) std::ranges::stable_sort(unfinished_, {}, finish);
  std::erase_if(unfinished_, [this](const auto& output) {
    const bool finished = output.first.record.finish <= now_;
    if (finished) explain_output(output.first, output.second);
    return finished;
  });
}

void Explainer::explain_output(const Seen& job, Duration latency) {
  Explanation explanation{repetition_, latency, {}, true, {}};
  std::vector<const Seen*> path = {&job};
  const bool hot_path = latency_ == Latency::hot_path;
  const Time begin = (hot_path ? job.record.start : job.record.finish) - latency;
  if (chain_ != nullptr) {
    path = paths_.from_source(job, begin, hot_path);
    explanation.complete = !path.empty();
    if (path.empty()) path = of_triggers(job, begin);
  }
  explanation.parts = parts_of_path(system_, window_, times_, path, begin, latency_);
  for (const Seen* seen : path) explanation.path.push_back(seen->record);
  explanation.waits = waits_of(system_, window_, explanation, begin);
  ++explained_;
  use_(explanation);
}

/// `sink` and the jobs that published the samples that started it, back to the last one that started
/// at or before `begin`, as far as the trace has them.
std::vector<const Seen*> Explainer::of_triggers(const Seen& sink, Time begin) const {
  std::vector<const Seen*> path = {&sink};
  while (path.back()->record.start > begin) {
    const Seen* const publisher = window_.find(path.back()->record.job.parent);
    if (publisher == nullptr || publisher->order >= path.back()->order) break;
    path.push_back(publisher);
  }
  std::ranges::reverse(path);
  return path;
}

}  // namespace hotpath::explain
