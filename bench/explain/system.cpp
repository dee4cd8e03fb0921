// SPDX-License-Identifier: Apache-2.0
#include "explain/system.hpp"

#include <algorithm>
#include <bit>

#include "hotpath/reference_system/graph_workload.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::explain {

namespace {

std::uint64_t all_cores(unsigned cores) {
  return cores >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << cores) - 1;
}

}  // namespace

System::System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks,
               results::RunKind kind, unsigned cores)
    : tasks_(tasks),
      kind_(kind),
      cores_(cores),
      delivery_(kind == results::RunKind::simulated ? graph.platform.delivery_delay : Duration{}),
      wall_clock_work_(graph.work == WorkMode::wall),
      chains_(index_chains(graph, tasks)),
      executor_of_(spec.deployment ? spec.deployment->plan.executor_of
                                   : std::vector<std::uint32_t>(tasks.set.size(), 0)) {
  for (const setup::ExecutorSpec& part : setup::parts(spec)) {
    ServingExecutor& executor = executors_.emplace_back();
    executor.traits = part.entry->traits;
    if (executor.traits.family == Family::priority_events) {
      executor.order.emplace(tasks.set, *executor.traits.policy, part.scheduler.rule, part.scheduler.ties);
      executor.service_wait = part.scheduler.guaranteed_wait;
    }
    const unsigned timer_threads = executor.traits.timers == TimerHandling::polled ? 0 : 1;
    executor.many_threads = worker_count(*part.entry, part.scheduler) > 1 + timer_threads;
  }
  if (kind != results::RunKind::simulated) return;
  const simulated::System system(spec, graph, tasks);
  for (std::size_t e = 0; e < executors_.size(); ++e) {
    const SimulatedExecutor& simulated = system.executors()[e];
    threads_.insert(threads_.end(), simulated.threads.begin(), simulated.threads.end());
    const Platform p = make_platform(graph, *setup::parts(spec)[e].entry);
    if (executors_[e].traits.timers == TimerHandling::release_only)
      executors_[e].second_wake_up = p.wake_up_latency;
    const auto entities = std::int64_t{tasks.set.size()} + simulated.other_entities;
    executors_[e].most_overhead = p.wake_up_latency + p.wait_cost + entities * p.wait_cost_per_entity +
                                  p.longest_dispatch_cost() + p.pass_cost +
                                  static_cast<std::int64_t>(tasks.set.size()) * p.release_cost;
  }
}

unsigned System::cores_of(std::size_t worker) const {
  const std::uint64_t allowed = worker < threads_.size() ? threads_[worker].processors : ~std::uint64_t{0};
  return static_cast<unsigned>(std::popcount(allowed & all_cores(cores_)));
}

bool System::outranks(std::size_t other, Time other_start, std::size_t worker, Time since) const {
  if (std::max(other, worker) >= threads_.size()) return other_start > since;
  const SimulatedThread &a = threads_[other], &b = threads_[worker];
  if ((a.processors & b.processors & all_cores(cores_)) == 0) return false;
  return a.priority != b.priority ? a.priority > b.priority : other_start > since;
}

bool System::share_group(TaskId a, TaskId b) const {
  const std::uint32_t group = task(a).group;
  return group == task(b).group && tasks_.set.groups[group] == CallbackGroup::mutually_exclusive &&
         executor_of_[a] == executor_of_[b] &&
         executor_of(a).traits.timers != TimerHandling::release_and_execute;
}

}  // namespace hotpath::explain
