// SPDX-License-Identifier: Apache-2.0
// The driver's timers: when they fall due next, and what changes that behind its back.
#include <rcl/timer.h>

#include <algorithm>
#include <mutex>

#include "driver.hpp"

namespace hotpath {

namespace {

/// What lies between two readings of a clock, and what a user cannot mean by a reset.
constexpr Duration kTolerance = std::chrono::microseconds(100);
/// Where a cancelled timer's reset cannot be noticed.
constexpr Duration kPollCancelled = std::chrono::milliseconds(20);

/// What rcl says of a timer.
struct Look {
  bool cancelled = false;
  Duration period{};
  Time earliest{}, latest{};  ///< Of the next call, as CLOCK_MONOTONIC; as close as this thread was let run.
};

Look look(rclcpp::TimerBase& timer) {
  Look seen;
  const std::shared_ptr<const rcl_timer_t> handle = timer.get_timer_handle();
  std::int64_t period = 0, until = 0;
  const Time before = now();
  const rcl_ret_t ret = rcl_timer_get_time_until_next_call(handle.get(), &until);
  const Time after = now();
  seen.cancelled = ret == RCL_RET_TIMER_CANCELED || timer.is_canceled();
  if (ret != RCL_RET_OK && !seen.cancelled) rclcpp::exceptions::throw_from_rcl_error(ret, "timer");
  if (rcl_timer_get_period(handle.get(), &period) != RCL_RET_OK) rcl_reset_error();
  seen.period = Duration(std::max<std::int64_t>(period, 1));
  seen.earliest = before + Duration(until);
  seen.latest = after + Duration(until);
  return seen;
}

TimerClock clock_of(rclcpp::TimerBase& timer) {
  const rclcpp::Clock::SharedPtr clock = versions::clock_of(timer);
  if (clock->get_clock_type() == RCL_STEADY_TIME) {
    return versions::kTimersTellOfResets ? TimerClock::steady : TimerClock::checked;
  }
  const bool simulated = clock->get_clock_type() == RCL_ROS_TIME && clock->ros_time_is_active();
  return simulated ? TimerClock::simulated : TimerClock::checked;
}

}  // namespace

void ExecutorDriver::join(const std::shared_ptr<Entry>& entry) {
  if (entry->kind == EntryKind::timer) {
    if (const auto timer = lock<rclcpp::TimerBase>(*entry)) schedule_timer(entry, *timer);
    return;
  }
  const std::lock_guard lock(mutex_);
  const Time now = hotpath::now();
  schedule_.join(entry, now, now);  // wakes nobody: nothing has arrived
}

std::vector<int> ExecutorDriver::leave(const std::shared_ptr<Entry>& entry) {
  const std::lock_guard lock(mutex_);
  entry->removed = true;
  const std::size_t dropped = schedule_.leave(*entry, now());
  if (entry->kind == EntryKind::waitable) return {entry->ready.begin(), entry->ready.end()};
  return std::vector<int>(dropped, 0);
}

void ExecutorDriver::schedule_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer) {
  const Look seen = look(timer);
  const TimerClock clock = clock_of(timer);
  WorkerSet claimed;
  {
    const std::lock_guard lock(mutex_);
    const Time now = hotpath::now();
    schedule_.leave(*entry, now);
    if (entry->removed) return;
    entry->clock = clock;
    entry->task.period = seen.period;
    entry->rcl_next = {seen.earliest, seen.latest};
    longest_period_ = std::max(longest_period_, seen.period);
    if (!seen.cancelled) claimed = claim(schedule_.join(entry, seen.earliest, now));
  }
  unpark(claimed);
  if (seen.cancelled) {
    retire_timer(entry);
  } else if (clock == TimerClock::simulated) {
    time_jumped(entry, false);
  }
}

void ExecutorDriver::retire_timer(const std::shared_ptr<Entry>& entry) {
  WorkerSet claimed;
  {
    const std::lock_guard lock(mutex_);
    schedule_.leave(*entry, now());
    if (entry->removed) return;
    if (!versions::kTimersTellOfResets) {
      cancelled_.push_back(entry);
      poll_at_ = std::min(poll_at_, now() + kPollCancelled);
      claimed = claim(WorkerSet::of(0));  // which polls, and may sleep for longer
    }
  }
  unpark(claimed);
  // It may have been reset since somebody saw that it was cancelled.
  const auto timer = lock<rclcpp::TimerBase>(*entry);
  if (timer && versions::kTimersTellOfResets && !timer->is_canceled()) schedule_timer(entry, *timer);
}

void ExecutorDriver::poll_cancelled() {
  std::vector<std::weak_ptr<Entry>> cancelled;
  {
    const std::lock_guard lock(mutex_);
    cancelled.swap(cancelled_);
    poll_at_ = kNever;
  }
  for (const std::weak_ptr<Entry>& weak : cancelled) {
    const std::shared_ptr<Entry> entry = weak.lock();
    const auto timer = entry ? lock<rclcpp::TimerBase>(*entry) : nullptr;
    if (timer) schedule_timer(entry, *timer);  // which comes back here if it is still cancelled
  }
}

void ExecutorDriver::timer_reset(const std::shared_ptr<Entry>& entry) {
  if (const auto timer = lock<rclcpp::TimerBase>(*entry)) schedule_timer(entry, *timer);
}

void ExecutorDriver::time_jumped(const std::shared_ptr<Entry>& entry, bool clock_changed) {
  const auto timer = lock<rclcpp::TimerBase>(*entry);
  if (!timer) return;
  if (clock_changed) return schedule_timer(entry, *timer);
  const Look seen = look(*timer);
  if (seen.cancelled || seen.earliest > now()) return;
  {
    const std::lock_guard lock(mutex_);
    if (entry->clock != TimerClock::simulated || std::exchange(entry->pending, true)) return;
  }
  arrived(entry, 1, 0);
}

bool ExecutorDriver::was_moved(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer) {
  const Look seen = look(timer);
  if (seen.cancelled || seen.earliest <= now()) return false;
  {
    const std::lock_guard lock(mutex_);
    const auto [earliest, latest] = entry->rcl_next;
    if (seen.earliest - kTolerance <= latest && earliest <= seen.latest + kTolerance) return false;
  }
  schedule_timer(entry, timer);
  return true;
}

bool ExecutorDriver::execute_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer) {
  std::unique_lock lock(mutex_);
  const TimerClock clock = entry->clock;
  const Duration known = entry->task.period;
  lock.unlock();
  if (clock == TimerClock::checked && was_moved(entry, timer)) return false;
  const bool ran = versions::run_timer(timer);
  after_timer(entry, timer, clock, known);
  return ran;
}

void ExecutorDriver::after_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer,
                                 TimerClock clock, Duration known) {
  if (timer.is_canceled()) return retire_timer(entry);
  if (clock == TimerClock::simulated) return time_jumped(entry, false);
  std::int64_t period = 0;
  if (rcl_timer_get_period(timer.get_timer_handle().get(), &period) != RCL_RET_OK) rcl_reset_error();
  if (period != known.count() && period > 0) return schedule_timer(entry, timer);
  if (clock != TimerClock::checked) return;
  const Look seen = look(timer);
  const std::lock_guard lock(mutex_);
  entry->rcl_next = {seen.earliest, seen.latest};
}

}  // namespace hotpath
