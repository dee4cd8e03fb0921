// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/periodic_task.hpp"

#include <algorithm>
#include <sstream>

#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

namespace {

[[noreturn]] void refuse(const PeriodicTasks& tasks, std::size_t position, const MethodScope& scope,
                         const std::string& problem, bool another_method_helps) {
  std::string message = task_label(tasks, position) + ": " + problem + ", which " +
                        std::string(scope.method) + " does not allow";
  if (another_method_helps) message += "; " + std::string(scope.instead) + " would";
  throw AnalysisError(message);
}

std::string ns(std::int64_t value) { return std::to_string(value) + " ns"; }

}  // namespace

PeriodicTasks periodic_tasks(const TaskSet& set, Policy policy) {
  const std::vector<std::int64_t> level = inherited_levels(set, policy);
  std::vector<TaskId> order;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind != TaskKind::timer) {
      throw AnalysisError("task '" + set[id].name +
                          "' is a subscription, and the methods for periodic tasks take timers only; the "
                          "analyses of whole graphs take subscriptions");
    }
    order.push_back(id);
  }
  std::stable_sort(order.begin(), order.end(), [&](TaskId a, TaskId b) { return level[a] < level[b]; });
  PeriodicTasks tasks;
  for (const TaskId id : order) {
    const Task& t = set[id];
    tasks.push_back({.name = t.name,
                     .id = id,
                     .wcet = t.wcet.count(),
                     .period = t.period.count(),
                     .deadline = t.deadline.count(),
                     .bcet = t.bcet.count(),
                     .jitter = 0,
                     .phase = t.phase.count()});
  }
  return tasks;
}

std::string task_label(const PeriodicTasks& tasks, std::size_t position) {
  const std::string& name = tasks[position].name;
  return name.empty() ? "task " + std::to_string(position + 1) + " in priority order" : "task '" + name + "'";
}

void check_tasks(const PeriodicTasks& tasks, const MethodScope& scope) {
  if (tasks.empty()) throw AnalysisError(std::string(scope.method) + ": the task set is empty");
  exact::Utilisation utilisation;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const PeriodicTask& t = tasks[i];
    if (t.wcet <= 0)
      refuse(tasks, i, scope, "worst-case execution time " + ns(t.wcet) + " is not positive", false);
    if (t.period <= 0) refuse(tasks, i, scope, "period " + ns(t.period) + " is not positive", false);
    if (t.deadline <= 0) refuse(tasks, i, scope, "deadline " + ns(t.deadline) + " is not positive", false);
    if (t.bcet < 0 || t.bcet > t.wcet) {
      refuse(tasks, i, scope, "best-case execution time " + ns(t.bcet) + " is outside of 0 to " + ns(t.wcet),
             false);
    }
    if (t.jitter < 0) refuse(tasks, i, scope, "release jitter " + ns(t.jitter) + " is negative", false);
    if (t.phase < 0) refuse(tasks, i, scope, "phase " + ns(t.phase) + " is negative", false);
    if (!scope.arbitrary_deadlines && t.deadline > t.period) {
      refuse(tasks, i, scope, "deadline " + ns(t.deadline) + " is longer than the period " + ns(t.period),
             true);
    }
    if (!scope.jitter && t.jitter != 0) refuse(tasks, i, scope, "release jitter " + ns(t.jitter), true);
    if (!scope.overload) utilisation.add(t.wcet, t.period);
  }
  if (!scope.overload && utilisation.compare_to_one() > 0) {
    std::ostringstream message;
    message << "the utilisation " << utilisation.value() << " is above 1, which " << scope.method
            << " does not allow; davis_2007 (exact NP-FP) still bounds the tasks whose priority level is not "
               "overloaded";
    throw AnalysisError(message.str());
  }
}

bool schedulable(const PeriodicTasks& tasks, const ResponseTimes& bounds) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!bounds[i] || *bounds[i] > tasks[i].deadline) return false;
  }
  return true;
}

}  // namespace hotpath
