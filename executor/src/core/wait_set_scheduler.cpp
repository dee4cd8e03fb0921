// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

namespace hotpath {

Arrival WaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  Arrival arrival;
  arrival.overwritten = unread_.add(task, sample).overwritten;
  arrival.wake = wait_mutex_.waiting();
  return arrival;
}

std::optional<Job> WaitSetScheduler::pick(Time now) {
  return take(now, [this](TaskId id) { return group_free(id) ? Pick::run : Pick::leave; });
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  const bool slept = wait_mutex_.enter(worker);
  const auto in_free_group = [this](TaskId id) { return group_free(id); };
  Decision decision;
  decision.job = pick(now);
  if (!decision.job) {
    if (blocked_ == Blocked::forgotten) forget_snapshot();
    const std::uint32_t tasks = poll(now, in_free_group);
    if (!slept) decision.waited_for = tasks;
    decision.job = pick(now);
  }
  if (decision.job) {
    decision.wake = wait_mutex_.next();
  } else if (wait_mutex_.wait(worker)) {
    decision.wake_at = next_timer(in_free_group);
  }
  return decision;
}

Effect WaitSetScheduler::finished(Worker, const Job& job, Time) {
  free_group(job.task);
  Effect effect;
  // The interrupt guard condition ends the wait, so that the next one includes the group again.
  effect.wake = wait_mutex_.waiting();
  return effect;
}

}  // namespace hotpath
