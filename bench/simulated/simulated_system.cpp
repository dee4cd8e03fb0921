// SPDX-License-Identifier: Apache-2.0
#include "simulated/simulated_system.hpp"

#include <algorithm>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

/// Of a timer management thread that is raised above executor threads of the ordinary policy, as live.
constexpr int kRaised = 90;

SimulatedThread thread_of(const DeployedExecutor& executor, const std::string& file, unsigned cores) {
  SimulatedThread thread;
  switch (executor.policy.scheduling_class) {
    case ThreadPolicy::Class::other:
      thread.nice = executor.policy.priority;
      break;
    case ThreadPolicy::Class::fifo:
      thread.priority = executor.policy.priority;
      break;
    case ThreadPolicy::Class::rr:
      throw InputError(
          file, executor.line,
          concat("executor ", executor.name, ": the simulator has no ", to_string(executor.policy)),
          "take fifo or other");
  }
  if (executor.processors.empty()) return thread;
  thread.processors = 0;
  for (const int processor : executor.processors) {
    if (static_cast<unsigned>(processor) >= cores) {
      throw InputError(
          file, executor.line,
          concat("executor ", executor.name, ": the simulated machine has no processor ", processor),
          concat("it has 0 to ", cores - 1, "; give it more with --cores"));
    }
    thread.processors |= std::uint64_t{1} << processor;
  }
  return thread;
}

}  // namespace

SimulatedSystem::SimulatedSystem(const ExecutorSpec& spec, const Graph& graph, const TaskSet& set)
    : executor_of_(spec.deployment ? spec.deployment->plan.executor_of
                                   : std::vector<std::uint32_t>(set.size(), 0)) {
  const std::span<const ExecutorSpec> all = parts(spec);
  for (std::size_t e = 0; e < all.size(); ++e) {
    SchedulerOptions scheduling = all[e].scheduler;
    // rclcpp's default on the simulated machine, not on this one.
    if (scheduling.workers == 0) scheduling.workers = std::max(2U, graph.platform.cores);
    SimulatedExecutor executor;
    executor.scheduler =
        schedulers_.emplace_back(all[e].entry->make(tasks_of_part(spec, set, e), scheduling)).get();
    SimulatedThread thread;
    if (spec.deployment) {
      const Deployment& plan = spec.deployment->plan;
      thread = thread_of(plan.executors[e], plan.file, graph.platform.cores);
    }
    const bool raises_timers = make_platform(graph, *all[e].entry).raised_releaser;
    for (const WorkerRole role : executor.scheduler->workers()) {
      executor.threads.push_back(thread);
      const bool raised = role == WorkerRole::timer_management && raises_timers;
      if (raised) executor.threads.back().priority = std::max(kRaised, thread.priority);
    }
    executors_.push_back(std::move(executor));
  }
}

}  // namespace hotpath
