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

void EventsScheduler::unfinished(Time now, const Visitor& visit) const {
  events_->for_each([&](const Job& job) {
    if (!unread_.is_subscription(job.task)) visit(job, Outcome::queued);
  });
  visit_unfinished(timers_.timers(), unread_, now, visit);
}

}  // namespace hotpath
