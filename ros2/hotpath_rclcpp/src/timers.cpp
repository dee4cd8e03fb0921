// SPDX-License-Identifier: Apache-2.0
// The driver's timers: when they are due next, and how it notices resets, cancellations and clock
// jumps.
#include <rcl/timer.h>

#include <algorithm>
#include <mutex>

#include "driver.hpp"

namespace hotpath {

namespace {

/// Larger than the delay between two clock readings, smaller than any meaningful reset.
constexpr Duration kTolerance = std::chrono::microseconds(100);
/// Polling interval for cancelled timers where rclcpp does not report resets.
constexpr Duration kPollCancelled = std::chrono::milliseconds(20);

/// The state of a timer in rcl.
struct Look {
  bool cancelled = false;
  Duration period{};          ///< rcl's value; it may be 0.
  Time earliest{}, latest{};  ///< Bounds of the next call (CLOCK_MONOTONIC); preemption widens them.
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
  seen.period = Duration(period);
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

/// Makes rcl's timer due at the next instant that is `offset` plus a multiple of its period, and
/// returns that instant; rcl's is later by the time between two readings of the clock.
Time align(rclcpp::TimerBase& timer, Duration offset, Duration period) {
  const rcl_timer_t* const handle = timer.get_timer_handle().get();
  versions::on_reset(timer, [](std::size_t) {});  // the next callback would learn of this reset
  const Time now = hotpath::now();
  const Duration until = period - (now.time_since_epoch() - offset) % period;
  std::int64_t before = 0;
  // rcl has no other way to set the next call.
  if (rcl_timer_exchange_period(handle, until.count(), &before) != RCL_RET_OK) {
    rclcpp::exceptions::throw_from_rcl_error(RCL_RET_ERROR, "a timer cannot start at its offset");
  }
  timer.reset();
  if (rcl_timer_exchange_period(handle, period.count(), &before) != RCL_RET_OK) {
    rclcpp::exceptions::throw_from_rcl_error(RCL_RET_ERROR, "a timer cannot get its period back");
  }
  return now + until;
}

}  // namespace

void ExecutorDriver::join(const std::shared_ptr<Entry>& entry) {
  if (entry->is_timer()) {
    const auto timer = lock<rclcpp::TimerBase>(*entry);
    if (!timer) return;
    std::optional<Duration> offset;
    {
      const std::lock_guard lock(mutex_);
      offset = schedule_.offset_of(*entry);
    }
    const bool may_move = !timer->is_canceled() && clock_of(*timer) != TimerClock::simulated;
    std::optional<Time> first;
    if (offset && may_move && entry->task.period > Duration::zero()) {
      first = align(*timer, *offset, entry->task.period);
    }
    schedule_timer(entry, *timer, first);
    return;
  }
  const std::lock_guard lock(mutex_);
  const Time now = hotpath::now();
  schedule_.join(entry, now, now);  // wakes no worker: nothing has arrived
  notices_.order_changed(now, longest_period_, false);
}

std::vector<int> ExecutorDriver::leave(const std::shared_ptr<Entry>& entry) {
  const std::lock_guard lock(mutex_);
  entry->removed = true;
  const std::size_t events = entry->events;
  schedule_.leave(*entry, now());
  if (entry->is_waitable()) return {entry->ready.begin(), entry->ready.end()};
  return std::vector<int>(events, 0);
}

void ExecutorDriver::schedule_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer,
                                    std::optional<Time> first) {
  const Look seen = look(timer);
  const TimerClock clock = clock_of(timer);
  wake_claimed([&] {
    const Time now = hotpath::now();
    if (releases_) release_until(now);
    schedule_.leave(*entry, now);
    if (entry->removed) return WorkerSet{};  // the functions below do nothing then
    entry->clock = clock;
    entry->task.always_due = seen.period <= Duration::zero();
    entry->task.period = std::max(seen.period, Duration(1));
    entry->rcl_next = {seen.earliest, seen.latest};
    longest_period_ = std::max(longest_period_, seen.period);
    if (seen.cancelled) return WorkerSet{};
    const WorkerSet claimed = claim(schedule_.join(entry, first.value_or(seen.earliest), now));
    release_now(now);
    notices_.order_changed(now, longest_period_, false);
    return claimed;
  });
  if (seen.cancelled) {
    retire_timer(entry);
  } else if (clock == TimerClock::simulated) {
    release_simulated(entry, timer);
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
      claimed = claim(everybody());  // sleeping workers may have a later wake-up
    }
  }
  unpark(claimed);
  // It may have been reset since it was seen as cancelled.
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
    if (timer) schedule_timer(entry, *timer);  // retires it again if it is still cancelled
  }
}

void ExecutorDriver::timer_reset(const std::shared_ptr<Entry>& entry) {
  if (const auto timer = lock<rclcpp::TimerBase>(*entry)) schedule_timer(entry, *timer);
}

void ExecutorDriver::time_jumped(const std::shared_ptr<Entry>& entry, bool clock_changed) {
  wake_claimed([&] {
    entry->clock_changed |= clock_changed;
    if (!std::exchange(entry->jumped, true)) jumped_.push_back(entry);
    return claim(everybody());
  });
}

void ExecutorDriver::release_jumped() {
  std::vector<std::weak_ptr<Entry>> jumped;
  {
    const std::lock_guard lock(mutex_);
    jumped.swap(jumped_);
  }
  for (const std::weak_ptr<Entry>& weak : jumped) {
    const std::shared_ptr<Entry> entry = weak.lock();
    if (!entry) continue;
    bool clock_changed = false;
    {
      const std::lock_guard lock(mutex_);
      entry->jumped = false;
      clock_changed = std::exchange(entry->clock_changed, false);
    }
    const auto timer = lock<rclcpp::TimerBase>(*entry);
    if (!timer) continue;
    clock_changed ? schedule_timer(entry, *timer) : release_simulated(entry, *timer);
  }
}

void ExecutorDriver::release_simulated(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer) {
  const Look seen = look(timer);
  if (seen.cancelled || seen.earliest > now()) return;
  wake_claimed([&] {
    if (entry->number == kNoTask || entry->clock != TimerClock::simulated) return WorkerSet{};
    if (std::exchange(entry->pending, true)) return WorkerSet{};
    // Keeps the distance to the deadline in simulated time.
    const Time now = hotpath::now();
    return enqueue(entry, {now, seen.earliest + entry->task.deadline, {}}, now);
  });
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

bool ExecutorDriver::execute_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer,
                                   const Started& started) {
  const auto& [job, clock, known, which] = started;
  if (clock == TimerClock::checked && known > Duration::zero() && was_moved(entry, timer)) return false;
  const bool ran = versions::run_timer(timer);
  after_timer(entry, timer, clock, known);
  return ran;
}

void ExecutorDriver::after_timer(const std::shared_ptr<Entry>& entry, rclcpp::TimerBase& timer,
                                 TimerClock clock, Duration known) {
  if (timer.is_canceled()) return retire_timer(entry);
  if (clock == TimerClock::simulated) return release_simulated(entry, timer);
  std::int64_t period = 0;
  if (rcl_timer_get_period(timer.get_timer_handle().get(), &period) != RCL_RET_OK) rcl_reset_error();
  if (period != known.count()) return schedule_timer(entry, timer);
  if (clock != TimerClock::checked || known == Duration::zero()) return;
  const Look seen = look(timer);
  {
    const std::lock_guard lock(mutex_);
    const auto [earliest, latest] = std::exchange(entry->rcl_next, {seen.earliest, seen.latest});
    // Without a reset, the next call moves by whole periods.
    const Duration apart = (seen.earliest - earliest) % known;
    const Duration off = std::min(abs(apart), known - abs(apart));
    if (off <= kTolerance + std::max(latest - earliest, seen.latest - seen.earliest)) return;
  }
  schedule_timer(entry, timer);
}

}  // namespace hotpath
