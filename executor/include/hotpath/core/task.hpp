// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

class ReleaseDelays;

/// Index of a task in its TaskSet. Indices follow the order of creation, which wait sets use.
using TaskId = std::uint32_t;
inline constexpr TaskId kNoTask = std::numeric_limits<TaskId>::max();

enum class TaskKind : std::uint8_t { timer, subscription };
constexpr auto enum_texts(TaskKind) { return texts_in_order<TaskKind>({"timer", "subscription"}); }

/// What stands for a subscription task in rclcpp, which offers ready entities kind by kind
/// (in_order_of_kinds). An action's server or client is a waitable, and so is a subscription within its
/// publisher's process to which samples come without the middleware (intra-process communication).
enum class EntityKind : std::uint8_t { subscription, service, client, waitable, intra_process };
constexpr auto enum_texts(EntityKind) {
  return texts_in_order<EntityKind>({"subscription", "service", "client", "waitable", "intra_process"});
}

/// Whether a job of this kind should not wait without limit (SchedulerOptions::service_wait).
[[nodiscard]] constexpr bool is_service(EntityKind kind) {
  return kind != EntityKind::subscription && kind != EntityKind::intra_process;
}

/// rclcpp's callback groups: tasks of one mutually exclusive group never overlap in a multi-threaded
/// executor.
enum class CallbackGroup : std::uint8_t { mutually_exclusive, reentrant };
constexpr auto enum_texts(CallbackGroup) {
  return texts_in_order<CallbackGroup>({"mutually_exclusive", "reentrant"});
}

/// What a graph states of a timer, and its task keeps. Subscriptions have zeros.
struct TimerTimes {
  Duration period{};          ///< Time between two timestamps, > 0.
  Duration deadline{};        ///< Relative, > 0 (implicit deadline: the period).
  Duration release_jitter{};  ///< A job becomes ready up to that long after its timestamp; < period.
  friend bool operator==(const TimerTimes&, const TimerTimes&) = default;
};

/// One callback: a timer, or one subscription of a node. What every job asks stands in one line of the cache.
struct alignas(64) Task : TimerTimes {
  TaskKind kind = TaskKind::timer;
  EntityKind entity = EntityKind::subscription;  ///< Subscriptions only.
  /// Subscriptions: under the paper's executors none of its jobs waits without limit, as requests and
  /// responses of services and actions should not (SchedulerOptions::service_wait).
  bool service = false;
  bool local = true;  ///< Runs in this process. Tasks of other processes only pass on their priorities.
  /// A timer of period 0 in rcl: due again as soon as its job has ended, so at most one job is
  /// pending. It is last in every order except given priorities, because it would use all the time.
  /// Events schedulers only.
  bool always_due = false;
  std::uint32_t group = 0;  ///< Index into TaskSet::groups.
  Duration phase{};         ///< Timers: first timestamp, relative to the epoch of the run, >= 0.
  /// Timers: when each job becomes ready; none: at its timestamp. Outlives the schedulers of the set.
  const ReleaseDelays* release_delays = nullptr;
  TaskId whole = kNoTask;   ///< In a part: the task's number in the whole set, which release_delays knows.
  std::uint32_t depth = 1;  ///< Subscriptions: history depth (KEEP_LAST), >= 1.
  std::string name;         ///< `Node` (timer) or `Node/topic` (subscription); unique in its set.
  Duration wcet{};          ///< Worst-case execution time, >= 0.
  Duration bcet{};          ///< Best-case execution time, 0 <= bcet <= wcet.
  std::optional<std::int64_t> priority;  ///< Given fixed priority, smaller first; used by policy `fp`.
  std::vector<TaskId> feeds;             ///< Subscriptions activated by the publications of this task's jobs.
};

/// Tasks in creation order with their callback groups.
struct TaskSet {
  std::vector<Task> tasks;
  std::vector<CallbackGroup> groups = {CallbackGroup::mutually_exclusive};

  const Task& operator[](TaskId id) const { return tasks[id]; }
  [[nodiscard]] TaskId size() const { return static_cast<TaskId>(tasks.size()); }
  [[nodiscard]] std::vector<TaskId> timers() const;
  [[nodiscard]] bool has_release_jitter() const {
    return std::ranges::any_of(tasks, [](const Task& task) { return task.release_jitter > Duration{}; });
  }
};

/// The place of the task's kind among those that one wait finds ready: timers, subscriptions, services,
/// clients, waitables (rclcpp 29.3 executor.cpp, Humble's allocator_memory_strategy.hpp). If subscriptions
/// run first, as in the static executor: subscriptions, timers, clients, services, waitables
/// (static_single_threaded_executor.cpp).
[[nodiscard]] constexpr int place_of_kind(const Task& task, TaskKind runs_first) {
  const bool timers_first = runs_first == TaskKind::timer;
  if (task.kind == TaskKind::timer) return timers_first ? 0 : 1;
  switch (task.entity) {
    case EntityKind::subscription:
      return timers_first ? 1 : 0;
    case EntityKind::service:
      return timers_first ? 2 : 3;
    case EntityKind::client:
      return timers_first ? 3 : 2;
    case EntityKind::waitable:
    case EntityKind::intra_process:
      break;
  }
  return 4;
}

/// The tasks by place_of_kind(); within a kind in `entity_order`, or if it is empty in the order of creation.
[[nodiscard]] std::vector<TaskId> in_order_of_kinds(const TaskSet& set, std::vector<TaskId> entity_order,
                                                    TaskKind runs_first = TaskKind::timer);

/// A subset of a task set, for a scheduler that serves only these tasks: each of many such
/// schedulers needs memory for its own tasks only.
struct TaskPart {
  TaskSet set;
  std::vector<TaskId> tasks;  ///< By id in `set`: the id in the whole set.
};

/// The part of `whole` with the tasks `ids`, in ascending order. `urgent` is empty, or gives for
/// each task of `whole` the timer whose priority it inherits. Timers needed for that but not in
/// `ids` follow all other tasks, are not local, and have no entry in TaskPart::tasks.
[[nodiscard]] TaskPart part_of(const TaskSet& whole, const std::vector<TaskId>& ids,
                               const std::vector<TaskId>& urgent = {});

/// A task that joins a set.
struct JoiningTask {
  Task task;  ///< Its `group` may be one past the last group of the set, which adds a group of kind
              ///< `new_group`. The tasks in `feeds` must be in the set.
  CallbackGroup new_group{};
  std::vector<TaskId> fed_by;  ///< Tasks whose publications activate this one.
};

/// Adds the task; its id is the previous number of tasks.
TaskId join(TaskSet& set, const JoiningTask& joining);
/// Removes the task from the graph: it keeps its id but is no longer local and has no edges.
void leave(TaskSet& set, TaskId id);

}  // namespace hotpath
