// SPDX-License-Identifier: Apache-2.0
#include "simulated/simulated_system.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::simulated {

namespace {

SimulatedThread thread_of(const DeployedThread& deployed, const DeployedExecutor& executor,
                          const std::string& file) {
  const ThreadPolicy::Class scheduling = executor.policy.scheduling_class;
  if (scheduling != ThreadPolicy::Class::other && scheduling != ThreadPolicy::Class::fifo)
    throw InputError(file, executor.line,
                     program::concat("executor ", executor.name, ": the simulator does not support ",
                                     to_string(executor.policy)),
                     "take fifo or other");
  SimulatedThread thread{.priority = deployed.priority};
  if (executor.policy.ordinary()) thread.nice = executor.policy.priority;
  if (!executor.processors.empty()) thread.processors = 0;
  for (const int processor : executor.processors) thread.processors |= std::uint64_t{1} << processor;
  return thread;
}

/// Makes the schedulers of a deployment, each for its part of the tasks.
class Parts {
 public:
  Parts(const TaskSet& set, const std::vector<std::uint32_t>& executor_of, std::size_t executors)
      : set_(set), tasks_(executors) {
    for (TaskId id = 0; id < set.size(); ++id) tasks_[executor_of[id]].push_back(id);
  }

  const std::vector<TaskId>& tasks(std::size_t executor) const { return tasks_[executor]; }

  std::unique_ptr<Scheduler> make(std::size_t executor, const setup::ExecutorSpec& spec) {
    const TaskPart part = part_of(set_, tasks_[executor], urgent_timers(spec.entry->traits.policy));
    SchedulerOptions options = spec.scheduler;
    if (!options.entity_order.empty()) options.entity_order = order_in(part, options.entity_order);
    return spec.entry->make(part.set, options);
  }

 private:
  /// Computed once for all executors of one policy.
  const std::vector<TaskId>& urgent_timers(const std::optional<Policy>& policy) {
    std::vector<TaskId>& timers = urgent_[policy];
    if (policy && timers.empty()) timers = most_urgent_timers(set_, *policy);
    return timers;
  }

  std::vector<TaskId> order_in(const TaskPart& part, const std::vector<TaskId>& whole) {
    if (place_.empty()) place_.resize(whole.size());
    for (TaskId i = 0; i < whole.size(); ++i) place_[whole[i]] = i;
    std::vector<TaskId> order(part.set.size());
    std::iota(order.begin(), order.end(), 0);
    const auto own = order.begin() + static_cast<std::ptrdiff_t>(part.tasks.size());
    std::sort(order.begin(), own,
              [&](TaskId a, TaskId b) { return place_[part.tasks[a]] < place_[part.tasks[b]]; });
    return order;
  }

  const TaskSet& set_;
  std::vector<std::vector<TaskId>> tasks_;  // by executor
  std::map<std::optional<Policy>, std::vector<TaskId>> urgent_;
  std::vector<TaskId> place_;  // by task, in the order of entities
};

}  // namespace

System::System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks)
    : executor_of_(spec.plan.executor_of) {
  executor_of_.resize(tasks.set.size());
  const std::span<const setup::ExecutorSpec> all = setup::parts(spec);
  const std::vector<DeployedThread> threads = setup::threads_of(graph, spec);
  Parts parts(tasks.set, executor_of_, all.size());
  for (std::size_t e = 0; e < all.size(); ++e) {
    SimulatedExecutor executor;
    if (all.size() > 1) {
      schedulers_.push_back(parts.make(e, all[e]));
      executor.tasks = parts.tasks(e);
    } else {
      schedulers_.push_back(all[e].entry->make(tasks.set, all[e].scheduler));
    }
    executor.scheduler = schedulers_.back().get();
    std::set<std::uint32_t> nodes;
    for (const TaskId id : parts.tasks(e)) nodes.insert(tasks.origin[id].node);
    executor.other_entities = kEntitiesOfANode * static_cast<std::uint32_t>(nodes.size());
    const SimulatedThread thread = thread_of(threads[e], all[e].place, spec.plan.file);
    for (const WorkerRole role : executor.scheduler->workers()) {
      executor.threads.push_back(thread);
      if (role == WorkerRole::timer_management) executor.threads.back().priority = threads[e].timers_priority;
    }
    executors_.push_back(std::move(executor));
  }
}

}  // namespace hotpath::simulated
