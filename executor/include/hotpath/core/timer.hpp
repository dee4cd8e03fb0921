// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "hotpath/core/job.hpp"
#include "hotpath/core/state_words.hpp"

namespace hotpath {

/// When the jobs of timers become ready, if not at their timestamps.
class ReleaseDelays {
 public:
  virtual ~ReleaseDelays() = default;
  /// The instant at which `job` becomes ready: `timestamp`, or up to Task::release_jitter later; kNever: when
  /// the driver calls ExploredScheduler::release_at(). Asked when the timer begins to wait for it.
  [[nodiscard]] virtual Time due(JobRef job, Time timestamp) const = 0;
};

/// The driver says when each job becomes ready.
class HeldReleases final : public ReleaseDelays {
 public:
  [[nodiscard]] Time due(JobRef, Time) const override { return kNever; }
};

/// Timer arithmetic of rcl (rcl/src/rcl/timer.c, rolling); no other code repeats it.
class Timer {
 public:
  Timer() = default;
  Timer(TaskId task, const Task& t, Time epoch)
      : task_(task),
        period_(t.period),
        deadline_(t.deadline),
        next_call_(epoch + t.phase),
        always_due_(t.always_due),
        release_jitter_(t.release_jitter),
        delayed_as_(t.whole == kNoTask ? task : t.whole),
        delays_(t.release_delays) {
    wait();
  }

  [[nodiscard]] TaskId task() const { return task_; }
  [[nodiscard]] Time next_call() const { return next_call_; }
  /// When the job of the next call becomes ready: at next_call(), or later with Task::release_delays.
  [[nodiscard]] Time due() const { return due_; }
  [[nodiscard]] bool is_ready(Time now) const { return due_ <= now; }
  /// Whether the driver says when it becomes ready, and has not yet.
  [[nodiscard]] bool is_held() const { return due_ == kNever && next_call_ != kNever; }
  void release_at(Time due) { due_ = due; }
  /// Whether the driver has said when it becomes ready.
  [[nodiscard]] bool is_released() const { return has_delays() && due_ != kNever; }
  /// See ExploredScheduler::released_by().
  void released_by(Time now) {
    if (is_released()) due_ = std::min(due_, now);
  }
  /// Whether jobs may become ready later than at their timestamps.
  [[nodiscard]] bool has_delays() const { return delays_ != nullptr; }
  [[nodiscard]] Duration release_jitter() const { return release_jitter_; }
  /// The job of the next call.
  [[nodiscard]] JobRef next_job() const { return {task_, sequence_}; }

  /// Returns the job of the next timestamp and advances to the following timestamp: by one period,
  /// and, if that is not strictly after `now`, by further whole periods until it is. The timestamps
  /// passed over are skipped.
  Job call(Time now) {
    Job job{.task = task_,
            .sequence = sequence_,
            .timestamp = next_call_,
            .release = now,
            .deadline = always_due_ ? kNever : next_call_ + deadline_,
            .skipped = would_skip(now)};
    next_call_ = always_due_ ? kNever : next_call_ + period_ * (1 + std::int64_t{job.skipped});
    sequence_ += 1 + job.skipped;
    wait();
    return job;
  }

  /// The job of an always-due timer has ended.
  void ended(Time now) { next_call_ = due_ = now; }

  /// The timer is never ready again.
  void cancel() { next_call_ = due_ = kNever; }

  /// The first timestamp after `now` that has not been called.
  [[nodiscard]] Time next_timestamp(Time now) const {
    if (next_call_ > now) return next_call_;
    return next_call_ + period_ * (1 + (now - next_call_) / period_);
  }

  /// Timestamps at or before `now` that a call at `now` would skip.
  [[nodiscard]] std::uint32_t would_skip(Time now) const {
    const Time following = next_call_ + period_;
    if (following > now || always_due_) return 0;
    return static_cast<std::uint32_t>(1 + (now - following) / period_);
  }

  void describe(StateWords& words) const {
    words.add(next_call_);
    if (delays_ != nullptr) words.add(is_held() ? 1 : 0);
  }

 private:
  /// Begins to wait for the next call.
  void wait() {
    due_ = delays_ == nullptr || next_call_ == kNever ? next_call_
                                                      : delays_->due({delayed_as_, sequence_}, next_call_);
  }

  TaskId task_ = kNoTask;
  Duration period_{1};
  Duration deadline_{};
  Time next_call_{};
  std::uint64_t sequence_ = 0;
  bool always_due_ = false;
  Duration release_jitter_{};
  TaskId delayed_as_ = kNoTask;  // Task::whole
  const ReleaseDelays* delays_ = nullptr;
  Time due_{};
};

}  // namespace hotpath
