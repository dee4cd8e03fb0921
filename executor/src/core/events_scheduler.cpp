// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/events_scheduler.hpp"

#include <algorithm>

namespace hotpath {

EventsScheduler::EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events)
    : events_(std::move(events)), set_(set), unread_(set) {}

void EventsScheduler::begin(Time epoch) { timers_.begin(set_, epoch); }

Arrival EventsScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time now) {
  UnreadSamples::Added added = unread_.add(task, sample);
  added.job.release = now;
  events_->push(added.job);
  return {WorkerSet::of(kExecutor), added.overwritten};
}

Decision EventsScheduler::next_event() {
  if (events_->empty()) return {};
  Job job = events_->pop();
  if (unread_.is_subscription(job.task)) {
    // The event is for any sample: it takes what there is, at the moment it runs. After an overwriting
    // that may be a younger sample than the one that brought the event.
    const Time release = job.release;
    if (unread_.count(job.task) > 0) {
      job = unread_.take(job.task);
      job.release = std::max(release, job.timestamp);
    } else {
      job.empty = true;
    }
  }
  return {job, kNever, {}};
}

Joined EventsScheduler::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join(set_, joining);
  unread_.add_task(set_[id]);
  for_each_queue([this](EventsQueue& queue) { queue.tasks_changed(set_); });
  if (set_[id].kind == TaskKind::subscription) return {id, {}};
  timers_.add(id, set_[id], now);
  return {id, WorkerSet::of(kTimerManagement)};
}

void EventsScheduler::remove_task(TaskId task, Time now, const Visitor& dropped) {
  const bool timer = set_[task].kind == TaskKind::timer;
  leave(set_, task);
  for_each_queue([&](EventsQueue& queue) {
    queue.erase(task, [&](const Job& job) {
      if (timer) dropped(job, Outcome::queued);  // a subscription's events are not its samples
    });
    queue.tasks_changed(set_);
  });
  if (timer) visit_due(timers_.remove(task), now, dropped);
  visit_unread(unread_, task, dropped);
  unread_.clear(task);
}

void EventsScheduler::unfinished(Time now, const Visitor& visit) const {
  events_->for_each([&](const Job& job) {
    if (!unread_.is_subscription(job.task)) visit(job, Outcome::queued);
  });
  visit_unfinished(timers_.timers(), unread_, now, visit);
}

}  // namespace hotpath
