// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/static_scheduler.hpp"

#include <algorithm>

namespace hotpath {

StaticScheduler::StaticScheduler(const TaskSet& set) : set_(set), unread_(set) {
  for (TaskId id = 0; id < set_.size(); ++id) {
    if (!set_[id].local) continue;
    (set_[id].kind == TaskKind::timer ? timer_ids_ : subscription_ids_).push_back(id);
  }
  ready_timers_.reserve(timer_ids_.size());
  ready_subscriptions_.reserve(subscription_ids_.size());
}

void StaticScheduler::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : timer_ids_) timers_.emplace_back(id, set_[id], epoch);
}

Arrival StaticScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {WorkerSet::of(0), unread_.add(task, sample).overwritten};
}

void StaticScheduler::wait(Time now) {
  waited_at_ = now;
  next_subscription_ = next_timer_ = 0;
  ready_subscriptions_.clear();
  ready_timers_.clear();
  for (std::uint32_t i = 0; i < subscription_ids_.size(); ++i) {
    if (unread_.count(subscription_ids_[i]) > 0) ready_subscriptions_.push_back(i);
  }
  for (std::uint32_t i = 0; i < timers_.size(); ++i) {
    if (timers_[i].is_ready(now)) ready_timers_.push_back(i);
  }
}

std::optional<Job> StaticScheduler::next_ready(Time now) {
  if (next_subscription_ < ready_subscriptions_.size()) {
    Job job = unread_.take(subscription_ids_[ready_subscriptions_[next_subscription_++]]);
    // A sample overwritten since the wait gave its place among the ready ones to a younger one.
    job.release = std::max(waited_at_, job.timestamp);
    return job;
  }
  while (next_timer_ < ready_timers_.size()) {
    Timer& timer = timers_[ready_timers_[next_timer_++]];
    if (!timer.is_ready(now)) continue;
    Job job = timer.call(now);
    job.release = waited_at_;
    return job;
  }
  return std::nullopt;
}

Decision StaticScheduler::decide(Worker, Time now) {
  Decision decision;
  decision.job = next_ready(now);
  if (!decision.job) {
    wait(now);
    decision.job = next_ready(now);
  }
  if (!decision.job) {
    for (const Timer& t : timers_) decision.wake_at = std::min(decision.wake_at, t.next_call());
  }
  return decision;
}

void StaticScheduler::unfinished(Time now, const Visitor& visit) const {
  visit_unfinished(timers_, unread_, now, visit);
}

}  // namespace hotpath
