// SPDX-License-Identifier: Apache-2.0
#include "explain/system.hpp"

#include <algorithm>
#include <bit>
#include <utility>

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
      executor_of_(spec.deployment ? spec.deployment->plan.executor_of
                                   : std::vector<std::uint32_t>(tasks.set.size(), 0)) {
  std::uint32_t next_worker = 0;
  for (const setup::ExecutorSpec& part : setup::parts(spec)) {
    ServingExecutor& executor = executors_.emplace_back();
    executor.traits = part.entry->traits;
    if (executor.traits.family == Family::priority_events) {
      executor.order.emplace(tasks.set, *executor.traits.policy, part.scheduler.rule, part.scheduler.ties);
      executor.service_wait = part.scheduler.service_wait;
    }
    executor.threads = job_threads(part);
    executor.first_worker =
        std::exchange(next_worker, next_worker + worker_count(*part.entry, part.scheduler));
  }
  if (!simulated) return;
  const simulated::System system(spec, graph, tasks);
  for (std::size_t e = 0; e < executors_.size(); ++e) {
    const SimulatedExecutor& of = system.executors()[e];
    threads_.insert(threads_.end(), of.threads.begin(), of.threads.end());
    const Platform p = make_platform(graph, *setup::parts(spec)[e].entry);
    if (executors_[e].traits.timers == TimerHandling::release_only)
      executors_[e].second_wake_up = p.wake_up_latency;
    const auto releases = static_cast<std::int64_t>(tasks.set.size());
    executors_[e].most_overhead = p.wake_up_latency + p.wait_cost +
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
         executor_of_[a] == executor_of_[b] &&
         executor_of(a).traits.timers != TimerHandling::release_and_execute;
}

}  // namespace hotpath::explain
