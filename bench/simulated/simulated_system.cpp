// SPDX-License-Identifier: Apache-2.0
#include "simulated/simulated_system.hpp"

#include <algorithm>
#include <set>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

SimulatedThread thread_of(const DeployedExecutor& executor, const std::string& file, unsigned cores) {
  SimulatedThread thread;
  switch (executor.policy.scheduling_class) {
    case ThreadPolicy::Class::other:
      thread.nice = executor.policy.priority;
      break;
    case ThreadPolicy::Class::fifo:
      thread.priority = executor.policy.priority;
      break;
    case ThreadPolicy::Class::batch:
    case ThreadPolicy::Class::idle:
    case ThreadPolicy::Class::rr:
    case ThreadPolicy::Class::deadline:
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

SimulatedSystem::SimulatedSystem(const ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks)
    : executor_of_(spec.deployment ? spec.deployment->plan.executor_of
                                   : std::vector<std::uint32_t>(tasks.set.size(), 0)) {
  const std::span<const ExecutorSpec> all = parts(spec);
  for (std::size_t e = 0; e < all.size(); ++e) {
    SimulatedExecutor executor;
    executor.scheduler =
        schedulers_.emplace_back(all[e].entry->make(tasks_of_part(spec, tasks.set, e), all[e].scheduler))
            .get();
    std::set<std::uint32_t> nodes;
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (executor_of_[id] == e) nodes.insert(tasks.origin[id].node);
    }
    executor.other_entities = kEntitiesOfANode * static_cast<std::uint32_t>(nodes.size());
    SimulatedThread thread;
    ThreadPolicy policy;
    if (spec.deployment) {
      const Deployment& plan = spec.deployment->plan;
      thread = thread_of(plan.executors[e], plan.file, graph.platform.cores);
      policy = plan.executors[e].policy;
    }
    const bool raises_timers = make_platform(graph, *all[e].entry).raised_releaser;
    for (const WorkerRole role : executor.scheduler->workers()) {
      executor.threads.push_back(thread);
      const bool raised = role == WorkerRole::timer_management && raises_timers;
      if (raised) executor.threads.back().priority = raised_above(policy).priority;
    }
    executors_.push_back(std::move(executor));
  }
}

}  // namespace hotpath
