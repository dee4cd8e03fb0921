// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/static_scheduler.hpp"

namespace hotpath {

namespace {

bool any(TaskId) { return true; }

}  // namespace

Arrival StaticScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {WorkerSet::of(0), unread_.add(task, sample).overwritten};
}

std::optional<Job> StaticScheduler::next_ready(Time now) {
  if (auto job = take_sample(any)) return job;
  // rclcpp asks again, although nobody else calls timers.
  return call_timer(now, [now](TaskId, const Timer& timer) { return timer.is_ready(now); });
}

Decision StaticScheduler::decide(Worker, Time now) {
  Decision decision;
  decision.job = next_ready(now);
  if (!decision.job) {
    poll(now, any);
    decision.job = next_ready(now);
  }
  if (!decision.job) decision.wake_at = next_timer(any);
  return decision;
}

}  // namespace hotpath
