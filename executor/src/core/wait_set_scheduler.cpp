// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

#include <algorithm>

namespace hotpath {

WaitSetScheduler::WaitSetScheduler(const TaskSet& set, unsigned workers)
    : set_(set), roles_(workers, WorkerRole::executor), unread_(set), group_busy_(set.groups.size(), false) {
  assert(workers >= 1 && workers <= kMaxWorkers);
  for (TaskId id = 0; id < set_.size(); ++id) {
    if (!set_[id].local) continue;
    (set_[id].kind == TaskKind::timer ? timer_ids_ : subscription_ids_).push_back(id);
  }
  ready_timers_.reserve(timer_ids_.size());
  ready_subscriptions_.reserve(subscription_ids_.size());
}

void WaitSetScheduler::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : timer_ids_) timers_.emplace_back(id, set_[id], epoch);
}

Arrival WaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  Arrival arrival;
  arrival.overwritten = unread_.add(task, sample).overwritten;
  if (waiting_) arrival.wake = WorkerSet::of(*waiting_);
  return arrival;
}

void WaitSetScheduler::poll(Time now) {
  polled_at_ = now;
  ready_timers_.clear();
  ready_subscriptions_.clear();
  for (std::uint32_t i = 0; i < timer_ids_.size(); ++i) {
    if (timers_[i].is_ready(now) && group_free(timer_ids_[i])) ready_timers_.add(i);
  }
  for (std::uint32_t i = 0; i < subscription_ids_.size(); ++i) {
    const TaskId id = subscription_ids_[i];
    if (unread_.count(id) > 0 && group_free(id)) ready_subscriptions_.add(i);
  }
}

void WaitSetScheduler::occupy_group(TaskId task) {
  const std::uint32_t group = set_[task].group;
  if (set_.groups[group] == CallbackGroup::mutually_exclusive) group_busy_[group] = true;
}

std::optional<Job> WaitSetScheduler::pick(Time now) {
  const auto timer = ready_timers_.take_first([&](std::uint32_t i) { return group_free(timer_ids_[i]); });
  if (timer) {
    Job job = timers_[*timer].call(now);
    job.release = polled_at_;
    occupy_group(job.task);
    return job;
  }
  const auto subscription =
      ready_subscriptions_.take_first([&](std::uint32_t i) { return group_free(subscription_ids_[i]); });
  if (subscription) {
    Job job = unread_.take(subscription_ids_[*subscription]);
    // A sample overwritten since the poll gave its place in the snapshot to a younger one.
    job.release = std::max(polled_at_, job.timestamp);
    occupy_group(job.task);
    return job;
  }
  return std::nullopt;
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  idle_.erase(worker);
  if (waiting_ == worker) waiting_.reset();

  Decision decision;
  decision.job = pick(now);
  if (!decision.job) {
    poll(now);
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
    for (std::uint32_t i = 0; i < timer_ids_.size(); ++i) {
      if (group_free(timer_ids_[i])) decision.wake_at = std::min(decision.wake_at, timers_[i].next_call());
    }
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

void WaitSetScheduler::unfinished(Time now, const Visitor& visit) const {
  visit_unfinished(timers_, unread_, now, visit);
}

}  // namespace hotpath
