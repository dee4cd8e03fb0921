// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// Index of a task in its TaskSet. The order of indices is the order of creation, which wait sets follow.
using TaskId = std::uint32_t;
inline constexpr TaskId kNoTask = std::numeric_limits<TaskId>::max();

enum class TaskKind : std::uint8_t { timer, subscription };
constexpr auto enum_texts(TaskKind) {
  return std::to_array<EnumText<TaskKind>>(
      {{TaskKind::timer, "timer"}, {TaskKind::subscription, "subscription"}});
}

/// rclcpp's callback groups: tasks of one mutually exclusive group never overlap in a multi-threaded
/// executor.
enum class CallbackGroup : std::uint8_t { mutually_exclusive, reentrant };
constexpr auto enum_texts(CallbackGroup) {
  return std::to_array<EnumText<CallbackGroup>>(
      {{CallbackGroup::mutually_exclusive, "mutually_exclusive"}, {CallbackGroup::reentrant, "reentrant"}});
}

/// One callback: a timer, or one subscription of a node.
struct Task {
  std::string name;  ///< `Node` (timer) or `Node/topic` (subscription); unique in its set.
  TaskKind kind = TaskKind::timer;
  Duration period{};  ///< Timers: distance of two timestamps, > 0. Subscriptions: 0.
  /// Timers of period 0 in rcl: due again at once when its job has ended, so that at most one is pending.
  /// Last in every order but that of given priorities, since it takes all the time there is. Events
  /// schedulers.
  bool always_due = false;
  Duration phase{};                      ///< Timers: first timestamp, relative to the epoch of the run, >= 0.
  Duration wcet{};                       ///< Worst-case execution time, >= 0.
  Duration bcet{};                       ///< Best-case execution time, 0 <= bcet <= wcet.
  Duration deadline{};                   ///< Timers: relative deadline, > 0 (implicit deadline: the period).
  std::optional<std::int64_t> priority;  ///< Given fixed priority, smaller first; used by policy `fp`.
  std::uint32_t depth = 1;               ///< Subscriptions: history depth (KEEP_LAST), >= 1.
  std::uint32_t group = 0;               ///< Index into TaskSet::groups.
  bool local = true;  ///< Runs in this process. Others are known only for the priorities that they hand down.
  std::vector<TaskId> feeds;  ///< Subscriptions that a publication of this task's jobs activates.
};

/// Tasks in creation order with their callback groups.
struct TaskSet {
  std::vector<Task> tasks;
  std::vector<CallbackGroup> groups = {CallbackGroup::mutually_exclusive};

  const Task& operator[](TaskId id) const { return tasks[id]; }
  [[nodiscard]] TaskId size() const { return static_cast<TaskId>(tasks.size()); }
};

/// Some tasks of a set as a set of its own, for a scheduler that serves no others: of many such schedulers
/// each needs memory for its own tasks alone.
struct TaskPart {
  TaskSet set;
  std::vector<TaskId> tasks;  ///< By number in `set`: the number in the whole set.
};

/// The part of `whole` with the tasks `ids`, which ascend. `urgent` is empty, or says by task of `whole`
/// which timer's priority it inherits: timers that are not in the part come behind all others, not local, and
/// have no number in TaskPart::tasks.
[[nodiscard]] TaskPart part_of(const TaskSet& whole, const std::vector<TaskId>& ids,
                               const std::vector<TaskId>& urgent = {});

/// A task that joins a set.
struct JoiningTask {
  Task task;                   ///< Its `group` may be one past the last of the set, which makes a new group
  CallbackGroup new_group{};   ///< of this kind. Whom it feeds must be in the set.
  std::vector<TaskId> fed_by;  ///< Tasks whose publications activate it.
};

/// Adds the task; its id is the number of tasks before.
TaskId join(TaskSet& set, const JoiningTask& joining);
/// The task keeps its id, but is no longer local and has no part in the graph.
void leave(TaskSet& set, TaskId id);

}  // namespace hotpath
