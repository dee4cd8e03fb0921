// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/static_scheduler.hpp"

namespace hotpath {

Arrival StaticScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {WorkerSet::of(0), unread_.add(task, sample)};
}

std::optional<Job> StaticScheduler::next_ready(Time now) {
  return take(now, [this, now](TaskId id) {
    // rclcpp checks a timer again, although no other thread calls it.
    return is_ready(id, now) ? Pick::run : Pick::leave;
  });
}

Decision StaticScheduler::decide(Worker, Time now) {
  Decision decision;
  decision.job = next_ready(now);
  if (!decision.job) {
    forget_snapshot();
    const std::uint32_t tasks = poll(now, [](TaskId) { return true; });
    decision.job = next_ready(now);
    if (!sleeps_ && decision.job) decision.waited_for = tasks;
  }
  sleeps_ = !decision.job;
  if (sleeps_) decision.wake_at = next_timer([](TaskId) { return true; });
  return decision;
}

}  // namespace hotpath
