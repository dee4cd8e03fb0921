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

/// A callback group as the scheduler numbers it.
struct Group {
  CallbackGroup kind{};
  std::uint32_t index = 0;       ///< In the scheduler of this generation. Guarded by the driver's lock.
  std::uint64_t generation = 0;  ///< 0: in none.
  std::weak_ptr<rclcpp::CallbackGroup> group;
};

enum class EntryKind : std::uint8_t { timer, subscription, service, client, waitable };

/// Where the instants of a timer come from.
enum class TimerClock : std::uint8_t {
  steady,     ///< Computed; a reset is told of.
  checked,    ///< Computed, and compared with rcl's at each expiry: resets or steps of the clock are not told
              ///< of.
  simulated,  ///< rcl is asked whenever simulated time moves.
};

/// What the driver knows of one entity of a node: one task of the scheduler. Its mutable part is guarded by
/// the driver's lock.
struct Entry {
  EntryKind kind{};
  std::weak_ptr<void> entity;  ///< A TimerBase, SubscriptionBase, ServiceBase, ClientBase or Waitable.
  std::string id;              ///< `/node@Timer(100000000)`, `/node@Subscription(/topic)`.
  std::string node, topic;     ///< Fully qualified names.
  bool intra_process = false;  ///< The waitable of an intra-process subscription.
  std::shared_ptr<Group> group;
  std::weak_ptr<void> stands_for;  ///< The subscription of an intra-process waitable.

  Task task;                ///< What the scheduler is told of it; timers: the period that it has.
  TaskId number = kNoTask;  ///< kNoTask: not in the schedule.
  TaskId ghost = kNoTask;   ///< Simulated time: the task that hands down the timer's priority.
  std::vector<std::weak_ptr<Entry>> feeds;  ///< Learnt.
  std::deque<int> ready;                    ///< Waitables: what is ready, first come first.
  std::size_t events = 0;  ///< In the scheduler's queue, those included whose sample was overwritten.

  TimerClock clock = TimerClock::steady;
  bool pending = false;        ///< Simulated time: released and not started.
  bool jumped = false;         ///< Among the driver's jumped timers.
  bool clock_changed = false;  ///< The jump was to or from simulated time.
  bool removed = false;        ///< From the executor.
  Time next_release = kNever;  ///< Timers: nominal instant.
  /// Checked timers: rcl's next call when it was last looked at, from and to.
  std::pair<Time, Time> rcl_next{kNever, kNever};
  // Written with the entities' lock held.
  std::shared_ptr<rclcpp::JumpHandler> jumps;
  std::unique_ptr<MessageCallback> messages;
};

template <class Entity>
std::shared_ptr<Entity> lock(const Entry& entry) {
  return std::static_pointer_cast<Entity>(entry.entity.lock());
}

}  // namespace hotpath
