// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/timer.hpp"

namespace hotpath {

std::uint32_t Timer::would_skip(Time now) const {
  const Time following = next_call_ + period_;
  if (following > now || always_due_) return 0;
  return static_cast<std::uint32_t>(1 + (now - following) / period_);
}

Job Timer::call(Time now) {
  const std::uint32_t skipped = would_skip(now);
  Job job;
  job.task = task_;
  job.sequence = sequence_;
  job.timestamp = next_call_;
  job.release = now;
  job.deadline = next_call_ + deadline_;
  job.skipped = skipped;
  next_call_ += period_ * (1 + static_cast<std::int64_t>(skipped));
  sequence_ += 1 + skipped;
  if (always_due_) {
    job.deadline = kNever;
    next_call_ = kNever;
  }
  wait();
  return job;
}

}  // namespace hotpath
