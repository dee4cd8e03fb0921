// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/scheduler.hpp"

namespace hotpath {

/// ROS 2 releases, from the oldest supported one on; each has one major version of rclcpp.
enum class RosDistro : std::uint8_t { humble, iron, jazzy, kilted, lyrical, rolling };
constexpr auto enum_texts(RosDistro) {
  return texts_in_order<RosDistro>({"humble", "iron", "jazzy", "kilted", "lyrical", "rolling"});
}

/// The range of releases, both ends included, in which an executor can run on rclcpp.
struct RosDistros {
  RosDistro first = RosDistro::humble;
  RosDistro last = RosDistro::rolling;
  [[nodiscard]] constexpr bool overlap(RosDistros r) const { return first <= r.last && r.first <= last; }
};

/// Options of an executor's scheduler; each applies to the executors named in its comment.
struct SchedulerOptions {
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  /// Multi-threaded: number of workers, at most most_threads(); 0 selects rclcpp's default, max(2,
  /// processors).
  unsigned workers = 0;
  /// Wait sets: all tasks in the order in which tasks of one kind are scanned (for `multi-jazzy`:
  /// at the start). Empty: order of creation. In rclcpp the order follows memory addresses
  /// (Humble's maps of weak pointers, Jazzy's hash maps).
  std::vector<TaskId> entity_order = {};
  /// `default`: the release of ROS 2 whose rules it follows.
  RosDistro release = RosDistro::jazzy;
  /// Release-only: number of executor workers, in [1, kMaxWorkers - 1]; rclcpp and the paper: one.
  unsigned release_only_workers = 1;
  /// The paper's executors: after this long in the queue, the oldest job of all services runs
  /// next, whatever its priority; at most one such job starts in any interval of this length. Zero: they
  /// are ordered like all others.
  Duration service_wait{};
};

/// The design that an executor follows.
enum class Family : std::uint8_t {
  wait_set,         ///< Level-triggered: polls a wait set (SingleThreaded-, Static-, MultiThreadedExecutor).
  events,           ///< Edge-triggered: a FIFO events queue (rclcpp's experimental EventsExecutor).
  priority_events,  ///< The paper's: priority events queue; all due timers are released together.
  callback_groups,  ///< A queue of ready callback groups (EventsCBGExecutor).
};
constexpr auto enum_texts(Family) {
  return texts_in_order<Family>({"wait_set", "events", "priority_events", "callback_groups"});
}

/// How an executor serves timers.
enum class TimerHandling : std::uint8_t {
  polled,               ///< The executor thread finds due timers in its wait set.
  release_only,         ///< The timer management thread releases timers into the events queue.
  release_and_execute,  ///< The timer management thread runs the timers itself.
  marked_ready,  ///< The timer management thread marks timers ready; the executor thread calls them and skips
                 ///< late timestamps.
};
constexpr auto enum_texts(TimerHandling) {
  return texts_in_order<TimerHandling>({"polled", "release_only", "release_and_execute", "marked_ready"});
}

/// Costs of an executor on the reference machine with the real ROS 2 stack
/// (reference_system/ros2_reference).
struct ReferenceCosts {
  unsigned cores;     ///< Processors available to the executor's threads.
  Duration dispatch;  ///< Median, end of a job to the start of the next one of the same snapshot.
  Duration wake_up;   ///< Median, due instant of a timer to the start of its job on an idle executor.
  Duration wait;  ///< Wait sets: end of a job to the start of the next one after a new wait, less `dispatch`
                  ///< and the cost of the entities.
  Duration wait_per_entity;  ///< Wait sets.
};

/// The traits by which code distinguishes executors; no code looks at an executor's name. No member
/// has a default: a new executor states all of them.
struct ExecutorTraits {
  Family family;
  TimerHandling timers;
  std::optional<Policy> policy;        ///< Order of the events queue; std::nullopt for wait sets.
  std::optional<TaskKind> runs_first;  ///< Wait sets: the kind of ready task that runs first.
  bool many_workers;                   ///< Accepts a number of threads (`multi:4`).
  bool raises_timer_thread;  ///< Raises the timer thread by default: live to SCHED_FIFO 90, simulated above
                             ///< the executor worker.
  bool compared_by_paper;    ///< Part of the paper's comparison (Section VII).
  std::optional<RosDistros> on_rclcpp;  ///< Releases with `--stack rclcpp`, as rclcpp's own executor or
                                        ///< hotpath_rclcpp's; std::nullopt: never.
  ReferenceCosts reference;
  std::string_view colour;  ///< Colour in every figure, `#RRGGBB`; families share a hue.

  /// The order of its jobs. Wait sets have no queue: their jobs count as in order of activation.
  [[nodiscard]] constexpr Policy queue_order() const { return policy.value_or(Policy::fifo); }
  /// The worker (index into Scheduler::workers()) that runs the timers' jobs.
  [[nodiscard]] constexpr Worker timer_worker() const {
    return timers == TimerHandling::release_and_execute ? 1 : 0;
  }
};

/// An executor that a user can select by name.
struct ExecutorEntry {
  std::string_view name;         ///< The name on the command line and in the column `executor`.
  std::string_view class_name;   ///< rclcpp's name of the executor class.
  std::string_view description;  ///< One line.
  ExecutorTraits traits;
  std::unique_ptr<Scheduler> (*make)(const TaskSet&, const SchedulerOptions&);
};

/// The baseline of comparisons: rclcpp's own default.
inline constexpr std::string_view kBaselineExecutor = "default";

/// All executors, in listing order.
[[nodiscard]] std::span<const ExecutorEntry> executors();

/// The largest number of threads for an executor with many workers.
[[nodiscard]] constexpr unsigned most_threads(const ExecutorTraits& traits) {
  return kMaxWorkers - (traits.timers == TimerHandling::polled ? 0 : 1);
}

/// Number of workers of the executor's scheduler (Scheduler::workers()), known before the scheduler
/// exists.
[[nodiscard]] std::uint32_t worker_count(const ExecutorEntry& entry, const SchedulerOptions& options);

/// nullptr for an unknown name.
[[nodiscard]] const ExecutorEntry* find_executor(std::string_view name);

}  // namespace hotpath
