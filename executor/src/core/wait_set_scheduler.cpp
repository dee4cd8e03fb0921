// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

namespace hotpath {

Arrival WaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  Arrival arrival;
  arrival.overwritten = unread_.add(task, sample).overwritten;
  if (waiting_) arrival.wake = WorkerSet::of(*waiting_);
  return arrival;
}

std::optional<Job> WaitSetScheduler::pick(Time now) {
  return take(now, [this](TaskId id) { return group_free(id) ? Pick::run : Pick::leave; });
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  idle_.erase(worker);
  const bool slept = waiting_ == worker;
  if (slept) waiting_.reset();

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
    // The next worker gets the wait mutex: it runs what is left of the snapshot, or waits in this one's
    // place.
    if (!waiting_ && !idle_.empty()) decision.wake = WorkerSet::of(idle_.first());
    return decision;
  }
  idle_.insert(worker);
  if (!waiting_) {
    waiting_ = worker;
    decision.wake_at = next_timer(in_free_group);
  }
  return decision;
}

Effect WaitSetScheduler::finished(Worker, const Job& job, Time) {
  free_group(job.task);
  Effect effect;
  // The interrupt guard condition, so that the group is in the wait again.
  if (waiting_) effect.wake = WorkerSet::of(*waiting_);
  return effect;
}

}  // namespace hotpath
