// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/job.hpp"

namespace hotpath {

/// Timer arithmetic of rcl (rcl/src/rcl/timer.c, rolling); no other code repeats it.
class Timer {
 public:
  Timer() = default;
  Timer(TaskId task, const Task& t, Time epoch)
      : task_(task),
        period_(t.period),
        deadline_(t.deadline),
        next_call_(epoch + t.phase),
        always_due_(t.always_due) {}

  [[nodiscard]] TaskId task() const { return task_; }
  [[nodiscard]] Time next_call() const { return next_call_; }
  [[nodiscard]] bool is_ready(Time now) const { return next_call_ <= now; }

  /// Returns the job of the next timestamp and advances to the following timestamp: by one period,
  /// and, if that is not strictly after `now`, by further whole periods until it is. The timestamps
  /// passed over are skipped.
  Job call(Time now);

  /// The job of an always-due timer has ended.
  void ended(Time now) { next_call_ = now; }

  /// The timer is never ready again.
  void cancel() { next_call_ = kNever; }

  /// The first timestamp after `now` that has not been called.
  [[nodiscard]] Time next_timestamp(Time now) const {
    if (next_call_ > now) return next_call_;
    return next_call_ + period_ * (1 + (now - next_call_) / period_);
  }

  /// Timestamps at or before `now` that a call at `now` would skip.
  [[nodiscard]] std::uint32_t would_skip(Time now) const;

 private:
  TaskId task_ = kNoTask;
  Duration period_{1};
  Duration deadline_{};
  Time next_call_{};
  std::uint64_t sequence_ = 0;
  bool always_due_ = false;
};

}  // namespace hotpath
