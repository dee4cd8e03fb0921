// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/events_scheduler.hpp"

#include <algorithm>

namespace hotpath {

EventsScheduler::EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, unsigned executors)
    : ExploredScheduler(set, executors, true), events_(std::move(events)), busy_(set.groups.size(), false) {}

void EventsScheduler::describe(StateWords& words) const {
  timers_.describe(words);
  events_->describe(words);
  services_.describe(words);
  for (TaskId id = 0; id < unread_.tasks(); ++id) {
    words.add(unread_.count(id));
    for (std::uint32_t i = 0; hands_deadlines_down() && i < unread_.count(id); ++i) {
      words.add(unread_.peek(id, i).deadline);
    }
  }
}

Arrival EventsScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time now) {
  Job job = next_sample(task, sample);
  Arrival arrival{executors(), unread_.push(task, job)};
  job.release = now;
  events_->push(job);
  if (services_.limits_waits() && set_[task].service) services_.arrived(task, now);
  return arrival;
}

const Job* EventsScheduler::next_of(EventsQueue& queue) const {
  if (!follows()) return timer_management() == 1 ? &queue.pop() : queue.pop_free(set_, busy_);
  return queue.pop_first([this](const Job& job) { return is_free(job.task) && may_run(job.task); });
}

Decision EventsScheduler::decide_events(Time now) {
  Decision decision;
  const Job* const event = events_->empty() ? nullptr : next_event(now);
  if (event == nullptr) return decision;
  const bool of_sample = unread_.is_subscription(event->task);
  if (of_sample && unread_.count(event->task) > 0) {
    // An event is not tied to one sample: it takes the oldest unread sample at the moment it runs.
    // If the history overflowed, that sample may be younger than the one that raised the event.
    decision.job = unread_.pop(event->task);
    decision.job->release = std::max(event->release, decision.job->timestamp);
  } else {
    decision.job = *event;
    decision.job->empty = of_sample;
  }
  return decision;
}

const Job* EventsScheduler::next_event(Time now) {
  const auto overdue = services_.overdue(now, [this](TaskId task) { return is_free(task) && may_run(task); });
  if (overdue) services_.started_overdue(now);
  const Job* const event =
      overdue ? events_->pop_first([&](const Job& j) { return j.task == *overdue; }) : next_of(*events_);
  if (event == nullptr) return event;
  const Task& task = set_[event->task];
  if (task.service) services_.started(event->task);
  if (timer_management() > 1)
    busy_[task.group] = set_.groups[task.group] == CallbackGroup::mutually_exclusive;
  return event;
}

Effect EventsScheduler::finished(Worker worker, const Job& job, Time now) {
  Effect effect;
  const Task& task = set_[job.task];
  if (task.always_due && task.local && task.kind == TaskKind::timer) {
    timers_.ended(job.task, now);
    effect.wake.insert(timer_management());
  }
  if (timer_management() == 1 || worker == timer_management()) return effect;
  busy_[set_[job.task].group] = false;
  events_->group_freed(set_[job.task].group);
  if (!events_->empty()) effect.wake |= executors();
  return effect;
}

Joined EventsScheduler::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join_set(joining);
  busy_.resize(set_.groups.size(), false);
  for_each_queue([this](EventsQueue& queue) { queue.tasks_changed(set_); });
  if (set_[id].kind == TaskKind::subscription || !set_[id].local) return {id, {}};
  timers_.add(id, set_[id], now);
  return {id, WorkerSet::of(timer_management())};
}

void EventsScheduler::remove_task(TaskId task, Time now, const Visitor& dropped) {
  const bool timer = set_[task].kind == TaskKind::timer && set_[task].local;
  leave(changed_set(), task);
  for_each_queue([&](EventsQueue& queue) {
    queue.erase(task, [&](const Job& job) {
      if (timer) dropped(job, Outcome::queued);  // a subscription's events are not its samples
    });
    queue.tasks_changed(set_);
  });
  if (timer) visit_due(timers_.remove(task), now, dropped);
  drop_unread(task, dropped);
  services_.removed(task);
}

void EventsScheduler::change_task(TaskId task, const std::optional<std::int64_t>& priority,
                                  const std::vector<TaskId>& feeds) {
  Task& changed = changed_set().tasks[task];
  changed.priority = priority;
  changed.feeds = feeds;
  for_each_queue([this](EventsQueue& queue) { queue.tasks_changed(set_); });
}

void EventsScheduler::unfinished(Time now, const Visitor& visit) const {
  events_->for_each([&](const Job& job) {
    if (!unread_.is_subscription(job.task)) visit(job, Outcome::queued);
  });
  ExploredScheduler::unfinished(now, visit);
}

Effect EventsScheduler::release_due(EventsQueue& queue, bool all, Time now) {
  Effect effect;
  while (timers_.due(now) && (all || effect.released == 0)) {
    queue.push(timers_.call_head(now));
    ++effect.released;
  }
  return effect;
}

Effect ReleaseOnlyScheduler::release_timers(Worker worker, Time now) {
  if (worker != timer_management()) return {};
  Effect effect = release_due(*events_, release_ == Release::all_due, now);
  if (effect.released > 0) effect.wake = executors();
  return effect;
}

}  // namespace hotpath
