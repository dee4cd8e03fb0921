// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/task.hpp"
#include "message_callback.hpp"

namespace hotpath {

/// A callback group and its number in the scheduler.
struct Group {
  CallbackGroup kind{};
  std::uint32_t index = 0;       ///< In the scheduler of `generation`. Guarded by the driver's lock.
  std::uint64_t generation = 0;  ///< 0: not in a scheduler yet.
  std::weak_ptr<rclcpp::CallbackGroup> group;
};

/// How the driver finds out when a timer is due.
enum class TimerClock : std::uint8_t {
  steady,     ///< It computes the instants; rclcpp reports resets.
  checked,    ///< It computes the instants and compares them with rcl's at each expiry, because rclcpp does
              ///< not report resets or steps of the clock.
  simulated,  ///< It asks rcl whenever simulated time moves.
};

/// One entity of a node and its task in the scheduler. The driver's lock guards its mutable part.
struct Entry {
  std::weak_ptr<void> entity;  ///< A TimerBase, SubscriptionBase, ServiceBase, ClientBase or Waitable.
  std::string id;              ///< `/node@Timer(100000000)`, `/node@Subscription(/topic)`.
  std::string node, topic;     ///< Fully qualified names.
  std::shared_ptr<Group> group;
  std::weak_ptr<void> stands_for;  ///< The subscription of an intra-process waitable.
  /// The address of its rcl handle, as in the `rcl_*_init` events of ros2_tracing; of an intra-process
  /// waitable that of its subscription; null for others. Only a number: it may be gone.
  const void* handle = nullptr;

  Task task;                ///< The scheduler's view; timers: with the current period.
  TaskId number = kNoTask;  ///< kNoTask: not in the schedule.
  /// A task that runs nothing but passes its priority on: to a timer of simulated time, or to a
  /// service or client with a given place.
  TaskId ghost = kNoTask;
  std::vector<std::weak_ptr<Entry>> feeds;  ///< Learnt.
  std::deque<int> ready;                    ///< Waitables: ids of ready entities, in order of arrival.
  std::size_t events = 0;  ///< Events in the scheduler's queue, including those of overwritten samples.

  bool from_outside = false;  ///< A sample came from outside this executor.
  bool waited_long = false;   ///< The log has named it for its waiting time.

  TimerClock clock = TimerClock::steady;
  bool pending = false;        ///< Simulated time: released and not started.
  bool jumped = false;         ///< Among the driver's jumped timers.
  bool clock_changed = false;  ///< The jump was to or from simulated time.
  bool removed = false;        ///< Removed from the executor.
  Time next_release = kNever;  ///< Timers: nominal instant.
  Time joined{};               ///< When it joined the schedule: a timer may have been due long before.
  /// Checked timers: bounds of rcl's next call at the last look.
  std::pair<Time, Time> rcl_next{kNever, kNever};
  // Written with the entities' lock held.
  std::shared_ptr<rclcpp::JumpHandler> jumps;
  std::unique_ptr<MessageCallback> messages;

  [[nodiscard]] bool is_timer() const { return task.kind == TaskKind::timer; }
  [[nodiscard]] bool is_waitable() const {
    return task.entity == EntityKind::waitable || task.entity == EntityKind::intra_process;
  }
};

template <class Entity>
std::shared_ptr<Entity> lock(const Entry& entry) {
  return std::static_pointer_cast<Entity>(entry.entity.lock());
}

}  // namespace hotpath
