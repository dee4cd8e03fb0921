// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/callback_group_scheduler.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

CallbackGroupScheduler::CallbackGroupScheduler(const TaskSet& set, unsigned workers, Requeue requeue)
    : ExploredScheduler(set, workers, true), requeue_(requeue), groups_(set.groups.size()) {
  ready_groups_.reserve(set.groups.size());
}

Joined CallbackGroupScheduler::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join_set(joining);
  groups_.resize(set_.groups.size());
  ready_groups_.reserve(set_.groups.size());
  if (set_[id].kind == TaskKind::subscription || !set_[id].local) return {id, {}};
  timers_.add(id, set_[id], now);
  return {id, timers_.must_look_for(id) ? WorkerSet::of(timer_manager()) : WorkerSet{}};
}

void CallbackGroupScheduler::remove_task(TaskId task, Time now, const Visitor& dropped) {
  if (set_[task].kind == TaskKind::timer && set_[task].local) visit_due(timers_.remove(task), now, dropped);
  drop_unread(task, dropped);
  leave(changed_set(), task);
  const std::uint32_t index = set_[task].group;
  Group& group = groups_[index];
  group.events.erase(task, [](const Job&) {});
  // A running group notices it at the end of its job.
  if (group.events.empty() && std::erase(ready_groups_, index) > 0) group.idle = true;
}

WorkerSet CallbackGroupScheduler::add_event(TaskId task, Time now) {
  const std::uint32_t index = set_.tasks[task].group;
  Group& group = groups_[index];
  Job event;
  event.task = task;
  event.release = now;
  group.events.push(event);
  if (!std::exchange(group.idle, false)) return {};
  return queue_group(index);
}

Effect CallbackGroupScheduler::release_timers(Worker worker, Time now) {
  Effect effect;
  if (worker != timer_manager()) return effect;
  for (; timers_.due(now); ++effect.released) effect.wake |= add_event(timers_.take_head(), now);
  return effect;
}

void CallbackGroupScheduler::describe(StateWords& words) const {
  timers_.describe(words);
  timers_.describe_waiting(words);
  for (TaskId id = 0; id < unread_.tasks(); ++id) words.add(unread_.count(id));
  for (const Group& group : groups_) {
    group.events.for_each([&](const Job& event) { words.add(event.task); });
    words.add(group.idle ? -1 : -2);
  }
  words.add(static_cast<std::int64_t>(ready_groups_.size()));
  for (const std::uint32_t group : ready_groups_) words.add(group);
  words.add(static_cast<std::int64_t>(idle_.bits()));
  words.add(woken_ ? static_cast<std::int64_t>(*woken_) : -1);
}

Job CallbackGroupScheduler::take(const Job& event, Time now) {
  Job job = event;
  if (set_.tasks[event.task].kind == TaskKind::timer) {
    job = timers_.call(event.task, now);
  } else if (unread_.count(event.task) > 0) {
    job = unread_.pop(event.task);
  } else {
    job.empty = true;
  }
  job.release = std::max(event.release, job.timestamp);
  return job;
}

Decision CallbackGroupScheduler::decide(Worker worker, Time now) {
  Decision decision;
  if (worker == timer_manager()) {
    decision.wake_at = timers_.next_due();
    return decision;
  }
  if (woken_ == worker) woken_.reset();
  const std::optional<Job> event = next_event();
  if (!event) {
    idle_.insert(worker);
    return decision;
  }
  idle_.erase(worker);
  decision.job = take(*event, now);
  if (requeue_ == Requeue::at_end) return decision;
  const std::uint32_t group = set_.tasks[event->task].group;
  if (set_.groups[group] == CallbackGroup::reentrant && !groups_[group].events.empty())
    ready_groups_.push_back(group);
  if (!ready_groups_.empty()) decision.wake = wake_one();
  return decision;
}

std::optional<Job> CallbackGroupScheduler::next_event() {
  if (ready_groups_.empty()) return std::nullopt;
  std::optional<Job> event;
  if (!follows()) {
    event = groups_[ready_groups_.front()].events.pop();
    ready_groups_.erase(ready_groups_.begin());
    return event;
  }
  // The first event of each group, and only if none may run a later one.
  for (const bool later : {false, true}) {
    const auto take_from = [&](std::uint32_t group) {
      bool first = true;
      event = groups_[group].events.pop_first(
          [&](const Job& job) { return (std::exchange(first, false) || later) && may_run(job.task); });
      return event.has_value();
    };
    const auto group = std::ranges::find_if(ready_groups_, take_from);
    if (group == ready_groups_.end()) continue;
    ready_groups_.erase(group);
    break;
  }
  return event;
}

Effect CallbackGroupScheduler::finished(Worker, const Job& job, Time now) {
  Effect effect;
  const Task& task = set_.tasks[job.task];
  if (task.kind == TaskKind::timer && task.local) {  // not removed meanwhile
    if (task.always_due) timers_.ended(job.task, now);
    timers_.wait(job.task);
    if (timers_.must_look_for(job.task)) effect.wake.insert(timer_manager());
  }
  Group& group = groups_[task.group];
  if (group.events.empty()) {
    group.idle = true;
  } else if (requeue_ == Requeue::at_end || std::ranges::count(ready_groups_, task.group) == 0) {
    effect.wake |= queue_group(task.group);
  }
  return effect;
}

}  // namespace hotpath
