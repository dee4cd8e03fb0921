// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "hotpath/core/scheduler.hpp"

namespace hotpath {

/// When a reentrant group with further events joins the queue of ready groups again.
enum class Requeue : std::uint8_t {
  at_end,       ///< When its job ends, like any group: cm_executors, and rclcpp before PR 3178.
  at_dispatch,  ///< When its job is dispatched, so that others run beside it: rclcpp from PR 3178 (2026) on.
};

/// EventsCBGExecutor (cm_executors: events_cbg_executor.cpp, FirstInFirstOutScheduler.cpp,
/// timer_manager.hpp; in rclcpp since Lyrical). Every callback group has a queue of ready events.
/// Groups that have events and run no job wait in a queue of groups. A worker takes the first group
/// from that queue and runs the group's first event; a group with more events then joins the end of
/// the queue. With Requeue::at_end two events of a group never run at once, even if it is reentrant. With
/// Requeue::at_dispatch they may, but not fully: an event that arrives while a job of the group runs and no
/// other event waits makes the group ready only at the end of one of its jobs.
///
/// One wake-up is pending at a time: the woken worker takes a group, then wakes another if there are more.
///
/// A due timer moves from the timer manager into its group's queue. It is called, by rcl's rule for
/// a late timer, when its job starts, and returns to the timer manager when the job has finished. A
/// subscription has one event per arrived sample; the event takes the oldest unread sample, or
/// nothing.
/// `workers` in [1, kMaxWorkers - 1] run events; one more manages the timers.
[[nodiscard]] std::unique_ptr<Scheduler> make_callback_group_scheduler(const TaskSet& set, unsigned workers,
                                                                       Requeue requeue);

}  // namespace hotpath
