// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/sequence_task.hpp"

#include <algorithm>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

std::int64_t SequenceTask::wcet() const {
  std::int64_t sum = 0;
  for (const std::int64_t segment : segments) sum = exact::add(sum, segment);
  return sum;
}

std::int64_t SequenceTask::longest_segment() const {
  return segments.empty() ? 0 : *std::max_element(segments.begin(), segments.end());
}

SequenceTasks sequence_tasks(const TaskSet& set, Policy policy) {
  std::vector<std::uint32_t> upstream(set.size(), 0);
  for (const Task& task : set.tasks) {
    if (task.feeds.size() > 1) {
      throw AnalysisError("task '" + task.name + "' feeds " + std::to_string(task.feeds.size()) +
                          " subscriptions, but in a sequence (paper, Section VI) a task feeds at most one");
    }
    for (const TaskId next : task.feeds) ++upstream[next];
  }
  const std::vector<std::int64_t> level = inherited_levels(set, policy);
  std::vector<TaskId> timers;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) {
      timers.push_back(id);
    } else if (upstream[id] != 1) {
      throw AnalysisError("subscription '" + set[id].name + "' is activated by " +
                          std::to_string(upstream[id]) +
                          " tasks, but in a sequence (paper, Section VI) by exactly one");
    }
  }
  std::stable_sort(timers.begin(), timers.end(), [&](TaskId a, TaskId b) { return level[a] < level[b]; });
  SequenceTasks tasks;
  std::size_t reached = 0;
  for (const TaskId timer : timers) {
    SequenceTask sequence{.name = set[timer].name,
                          .id = timer,
                          .segments = {},
                          .period = set[timer].period.count(),
                          .deadline = set[timer].deadline.count()};
    for (TaskId id = timer; id != kNoTask; id = set[id].feeds.empty() ? kNoTask : set[id].feeds[0]) {
      sequence.segments.push_back(set[id].wcet.count());
      ++reached;
    }
    tasks.push_back(std::move(sequence));
  }
  if (reached != set.size()) {
    throw AnalysisError(
        "some subscriptions activate each other in a circle without a timer; a sequence begins with "
        "a timer (paper, Section VI)");
  }
  return tasks;
}

void check_sequences(const SequenceTasks& tasks, std::string_view method, bool arbitrary_deadlines) {
  PeriodicTasks whole;
  for (const SequenceTask& s : tasks) {
    for (const std::int64_t segment : s.segments) {
      if (segment < 0) {
        throw AnalysisError("sequence '" + s.name + "': segment of " + std::to_string(segment) +
                            " ns is negative, which " + std::string(method) + " does not allow");
      }
    }
    if (s.suspension < 0) {
      throw AnalysisError("sequence '" + s.name + "': suspension of " + std::to_string(s.suspension) +
                          " ns is negative, which " + std::string(method) + " does not allow");
    }
    whole.push_back(
        {.name = s.name, .id = s.id, .wcet = s.wcet(), .period = s.period, .deadline = s.deadline});
  }
  check_tasks(whole, {.method = method,
                      .instead = "buttazzo_2013 (limited preemption without suspension)",
                      .arbitrary_deadlines = arbitrary_deadlines});
}

}  // namespace hotpath
