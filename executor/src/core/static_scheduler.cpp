// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/static_scheduler.hpp"

namespace hotpath {

Arrival StaticScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {WorkerSet::of(0), unread_.add(task, sample).overwritten};
}

std::optional<Job> StaticScheduler::next_ready(Time now) {
  return take(now, [this, now](TaskId id) {
    // rclcpp asks a timer again, although nobody else calls it.
    return is_ready(id, now) ? Pick::run : Pick::leave;
  });
}

Decision StaticScheduler::decide(Worker, Time now) {
  Decision decision;
  decision.job = next_ready(now);
  if (!decision.job) {
    forget_snapshot();
    decision.waited_for = poll(now, [](TaskId) { return true; });
    decision.job = next_ready(now);
  }
  if (!decision.job) decision.wake_at = next_timer([](TaskId) { return true; });
  return decision;
}

}  // namespace hotpath
