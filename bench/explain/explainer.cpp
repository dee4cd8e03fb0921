// SPDX-License-Identifier: Apache-2.0
#include "explain/explainer.hpp"

#include <algorithm>
#include <utility>

#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"
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

namespace {

using program::concat;

auto key_of(const Output& o) { return std::pair(o.sink, o.sequence); }

/// The waits in an explanation of a latency that begins at `begin`, each from when others ran on.
std::vector<ThreadsInWait> waits_of(const System& system, const JobWindow& window, const Explanation& e,
                                    Time begin) {
  const TaskSet& set = system.tasks.set;
  const auto ms = [&](Time at) {
    return at == kNever ? "the end of the run" : program::fixed(to_ms(at - begin), 3);
  };
  std::vector<ThreadsInWait> waits;
  Time at = begin;
  for (const Part& part : e.parts) {
    const Time from = std::exchange(at, at + part.length);
    const JobRecord& waiting = e.path[part.step];
    const ServingExecutor& executor = system.executor_of(waiting.job.task);
    const bool for_others = part.behind.task != kNoTask || part.cause == Cause::snapshot;
    const bool known = !waits.empty() && waits.back().step == part.step;
    if (!executor.many_threads() || !for_others || known || from >= waiting.start) continue;
    std::string sentence = concat(name_of(set, waiting.job.ref()), " waited from ", ms(from), " to ",
                                  ms(waiting.start), " ms: ");
    for (std::size_t w = executor.first_worker; w < executor.first_worker + executor.threads; ++w) {
      std::string jobs;
      for (const Seen* const job : window.of_worker(w, from, waiting.start)) {
        if (job->finish == job->start) continue;
        jobs +=
            concat(jobs.empty() ? "" : ", ", name_of(set, job->job.ref()), " (", ms(job->start), " to ",
                   ms(job->finish),
                   system.share_group(job->job.task, waiting.job.task) ? ", in its callback group)" : ")");
      }
      sentence += concat(w == executor.first_worker ? "" : "; ", "thread ", w, " ran ",
                         jobs.empty() ? "no job" : jobs);
    }
    waits.push_back({part.step, from, waiting.start, executor.threads, sentence + "."});
  }
  return waits;
}

}  // namespace

Explainer::Explainer(const System& system, std::optional<std::uint32_t> chain, Latency latency,
                     std::vector<Output> outputs, const ExecutionTimes* times, Use use)
    : system_(system),
      latency_(chain ? latency : Latency::response),
      times_(times),
      outputs_(std::move(outputs)),
      use_(std::move(use)),
      window_(system.tasks.set.size()) {
  if (chain) paths_.emplace(system.tasks, window_, system.chains[*chain]);
  std::ranges::sort(outputs_, {}, key_of);
  for (const Output& output : outputs_) longest_ = std::max(longest_, output.latency);
}

void Explainer::add(const JobRecord& record) {
  if (!record.started()) return;
  now_ = record.start;
  explain_finished();
  constexpr std::size_t kBetween = 1024;  // jobs between two clean-ups
  if (++added_ % kBetween == 0) {
    Time first = now_;
    for (const auto& [job, output] : unfinished_) first = std::min(first, job->start);
    window_.forget_before(first - longest_);
  }
  const Seen& seen = window_.add(record);
  if (paths_) paths_->add(seen);
  const std::pair key(record.job.task, record.job.sequence);
  const auto output = std::ranges::lower_bound(outputs_, key, {}, key_of);
  if (output != outputs_.end() && key_of(*output) == key) unfinished_.emplace_back(&seen, &*output);
}

void Explainer::explain_finished() {
  const auto finish = [](const auto& output) { return output.first->finish; };
  if (unfinished_.size() > 1) std::ranges::stable_sort(unfinished_, {}, finish);
  auto output = unfinished_.begin();
  for (; output != unfinished_.end() && finish(*output) <= now_; ++output)
    explain_output(*output->first, *output->second);
  unfinished_.erase(unfinished_.begin(), output);
}

void Explainer::explain_output(const Seen& job, const Output& output) {
  Explanation explanation{output.repetition, output.latency, {}, true, {}};
  Jobs path = {&job};
  const bool hot_path = latency_ == Latency::hot_path;
  const Time begin = (hot_path ? job.start : job.finish) - output.latency;
  if (paths_) path = paths_->from_source(job, begin, hot_path);
  explanation.complete = !path.empty();
  if (path.empty()) path = window_.of_triggers(job, begin);
  explanation.parts = parts_of_path(system_, window_, times_, path, begin, latency_);
  for (const Seen* const seen : path) explanation.path.push_back(*seen);
  explanation.waits = waits_of(system_, window_, explanation, begin);
  use_(explanation);
}

}  // namespace hotpath::explain
