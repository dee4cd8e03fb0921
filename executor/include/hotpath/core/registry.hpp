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

struct SchedulerOptions {
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  /// Multi-threaded: number of workers, not above most_threads(); 0 takes rclcpp's default, max(2,
  /// processors).
  unsigned workers = 0;
  /// Wait sets: all tasks in the order in which those of one kind are scanned, for `multi-jazzy` at the
  /// start; empty: that of creation. With rclcpp it follows addresses in memory (Humble's maps of weak
  /// pointers, Jazzy's hash maps).
  std::vector<TaskId> entity_order = {};
  /// Release-only: executor workers, in [1, kMaxWorkers - 1]; rclcpp and the paper have one.
  unsigned release_only_workers = 1;
};

/// Which design of rclcpp an executor follows.
enum class Family : std::uint8_t {
  wait_set,         ///< Level-triggered: polls a wait set (SingleThreaded-, Static-, MultiThreadedExecutor).
  events,           ///< Edge-triggered: a FIFO events queue (rclcpp's experimental EventsExecutor).
  priority_events,  ///< The paper's: priority events queue, timers released all together.
  callback_groups,  ///< A queue of ready callback groups (EventsCBGExecutor).
};
constexpr auto enum_texts(Family) {
  return std::to_array<EnumText<Family>>({{Family::wait_set, "wait_set"},
                                          {Family::events, "events"},
                                          {Family::priority_events, "priority_events"},
                                          {Family::callback_groups, "callback_groups"}});
}

/// How an executor serves timers.
enum class TimerHandling : std::uint8_t {
  polled,               ///< The executor thread finds them ready in its wait set.
  release_only,         ///< The timer management thread releases them into the events queue.
  release_and_execute,  ///< The timer management thread runs them itself.
  marked_ready,  ///< The timer management thread marks them ready, the executor thread calls them and skips.
};
constexpr auto enum_texts(TimerHandling) {
  return std::to_array<EnumText<TimerHandling>>({{TimerHandling::polled, "polled"},
                                                 {TimerHandling::release_only, "release_only"},
                                                 {TimerHandling::release_and_execute, "release_and_execute"},
                                                 {TimerHandling::marked_ready, "marked_ready"}});
}

/// What an executor costs on the reference machine with the real ROS 2 stack
/// (reference_system/ros2_reference).
struct ReferenceCosts {
  unsigned cores;            ///< Processors that its threads had.
  Duration dispatch;         ///< End of a job to the start of the next one of the same snapshot, median.
  Duration wake_up;          ///< A timer's instant to the start of its job when nothing ran, median.
  Duration wait;             ///< Wait sets: end of a job to the start of the next by a new wait, beyond
                             ///< `dispatch` and what the entities cost.
  Duration wait_per_entity;  ///< Wait sets.
};

/// Releases of ROS 2 from the oldest that is supported on; each has one major version of rclcpp.
enum class RosDistro : std::uint8_t { humble, iron, jazzy, kilted, lyrical, rolling };
constexpr auto enum_texts(RosDistro) {
  return std::to_array<EnumText<RosDistro>>({{RosDistro::humble, "humble"},
                                             {RosDistro::iron, "iron"},
                                             {RosDistro::jazzy, "jazzy"},
                                             {RosDistro::kilted, "kilted"},
                                             {RosDistro::lyrical, "lyrical"},
                                             {RosDistro::rolling, "rolling"}});
}

/// The releases in which an executor can run on rclcpp, both included.
struct RosDistros {
  RosDistro first = RosDistro::humble;
  RosDistro last = RosDistro::rolling;
  [[nodiscard]] constexpr bool has(RosDistro distro) const { return first <= distro && distro <= last; }
};

/// What an executor is, for code that treats executors differently; nothing asks for it by their names. No
/// member has a default: a new executor states all of them.
struct ExecutorTraits {
  Family family;
  TimerHandling timers;
  std::optional<Policy> policy;        ///< Order of the events queue; none for wait sets.
  std::optional<TaskKind> runs_first;  ///< Wait sets: the kind of ready task that runs first.
  bool many_workers;                   ///< Takes a number of threads (`multi:4`).
  bool raises_timer_thread;  ///< Live by default at SCHED_FIFO 90, simulated above the executor worker.
  bool compared_by_paper;    ///< One of the paper's comparison (Section VII).
  std::optional<RosDistros> on_rclcpp;  ///< `--stack rclcpp`, rclcpp's own or hotpath_rclcpp's; none: never.
  ReferenceCosts reference;
  std::string_view colour;  ///< In every figure, `#RRGGBB`; families share a hue.

  /// The worker (of Scheduler::workers()) that runs timers' jobs.
  [[nodiscard]] constexpr Worker timer_worker() const {
    return timers == TimerHandling::release_and_execute ? 1 : 0;
  }
};

/// One executor that a user can name.
struct ExecutorEntry {
  std::string_view name;         ///< As on the command line and in the column `executor`.
  std::string_view class_name;   ///< rclcpp's name of the executor class.
  std::string_view description;  ///< One line.
  ExecutorTraits traits;
  std::unique_ptr<Scheduler> (*make)(const TaskSet&, const SchedulerOptions&);
};

/// The executor to which comparisons refer: rclcpp's own default.
inline constexpr std::string_view kBaselineExecutor = "default";

/// All executors, in the order in which they are listed. A new one is one row here.
[[nodiscard]] std::span<const ExecutorEntry> executors();

/// The most threads that an executor with many workers can be given.
[[nodiscard]] constexpr unsigned most_threads(const ExecutorTraits& traits) {
  return kMaxWorkers - (traits.timers == TimerHandling::polled ? 0 : 1);
}

/// Workers of the executor's scheduler (Scheduler::workers()): for code that must know before there is one.
[[nodiscard]] std::uint32_t worker_count(const ExecutorEntry& entry, const SchedulerOptions& options);

/// nullptr for an unknown name.
[[nodiscard]] const ExecutorEntry* find_executor(std::string_view name);

}  // namespace hotpath
