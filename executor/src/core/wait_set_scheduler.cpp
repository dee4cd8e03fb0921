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
  std::optional<Job> job = call_timer(now, [this](TaskId id, const Timer&) { return group_free(id); });
  if (!job) job = take_sample([this](TaskId id) { return group_free(id); });
  if (job) {
    const std::uint32_t group = set_[job->task].group;
    if (set_.groups[group] == CallbackGroup::mutually_exclusive) group_busy_[group] = true;
  }
  return job;
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  idle_.erase(worker);
  if (waiting_ == worker) waiting_.reset();

  const auto group_is_free = [this](TaskId id) { return group_free(id); };
  Decision decision;
  decision.job = pick(now);
  if (!decision.job) {
    poll(now, group_is_free);
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
    decision.wake_at = next_timer(group_is_free);
  }
  return decision;
}

Effect WaitSetScheduler::finished(Worker, const Job& job, Time) {
  group_busy_[set_[job.task].group] = false;
  Effect effect;
  // The interrupt guard condition, so that the group is in the wait again.
  if (waiting_) effect.wake = WorkerSet::of(*waiting_);
  return effect;
}

}  // namespace hotpath
