// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/callback_group_scheduler.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

CallbackGroupScheduler::CallbackGroupScheduler(const TaskSet& set, unsigned workers, Requeue requeue)
    : ExploredScheduler(set, workers, true),
      requeue_(requeue),
      timer_index_(set.size(), 0),
      groups_(set.groups.size()) {
  ready_groups_.reserve(set.groups.size());
}

void CallbackGroupScheduler::begin(Time epoch) {
  for (TaskId id = 0; id < set_.size(); ++id) {
    if (!set_[id].local || set_[id].kind != TaskKind::timer) continue;
    timer_index_[id] = static_cast<std::uint32_t>(timers_.size());
    timers_.emplace_back(id, set_[id], epoch);
  }
  waiting_.reserve(timers_.size());
  any_delays_ = std::ranges::any_of(timers_, &Timer::has_delays);
  for (const Timer& timer : timers_) manage(static_cast<std::uint32_t>(&timer - timers_.data()));
}

bool CallbackGroupScheduler::manage(std::uint32_t timer) {
  waiting_.push_back({timers_[timer].due(), waited_++, timer});
  std::push_heap(waiting_.begin(), waiting_.end(), later);
  // The timer thread does not foresee delays, so it waits anew.
  return any_delays_ || waiting_.front().timer == timer;
}

Joined CallbackGroupScheduler::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join_set(joining);
  groups_.resize(set_.groups.size());
  ready_groups_.reserve(set_.groups.size());
  timer_index_.push_back(static_cast<std::uint32_t>(timers_.size()));
  if (set_[id].kind == TaskKind::subscription || !set_[id].local) return {id, {}};
  timers_.emplace_back(id, set_[id], now);
  waiting_.reserve(timers_.size());
  return {id, manage(timer_index_[id]) ? WorkerSet::of(timer_manager()) : WorkerSet{}};
}

void CallbackGroupScheduler::remove_task(TaskId task, Time now, const Visitor& dropped) {
  if (set_[task].kind == TaskKind::timer && set_[task].local) {
    const std::uint32_t timer = timer_index_[task];
    visit_due(timers_[timer], now, dropped);
    timers_[timer].cancel();
    std::erase_if(waiting_, [&](const Waiting& w) { return w.timer == timer; });
    std::make_heap(waiting_.begin(), waiting_.end(), later);
  }
  drop_unread(task, dropped);
  leave(changed_set(), task);
  const std::uint32_t index = set_[task].group;
  Group& group = groups_[index];
  group.events.erase(task, [](const Job&) {});
  // A running group notices it at the end of its job.
  if (group.events.empty() && std::erase(ready_groups_, index) > 0) group.idle = true;
}

WorkerSet CallbackGroupScheduler::queue_group(std::uint32_t group) {
  ready_groups_.push_back(group);
  return wake_one();
}

WorkerSet CallbackGroupScheduler::wake_one() {
  if (idle_.empty() || woken_) return {};
  const Worker worker = idle_.pop_first();
  if (requeue_ == Requeue::at_dispatch) woken_ = worker;
  return WorkerSet::of(worker);
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
  while (!waiting_.empty() && waiting_.front().due <= now) {
    const std::uint32_t timer = waiting_.front().timer;
    std::pop_heap(waiting_.begin(), waiting_.end(), later);
    waiting_.pop_back();
    effect.wake |= add_event(timers_[timer].task(), now);
    ++effect.released;
  }
  return effect;
}

void CallbackGroupScheduler::release_at(TaskId timer, Time due) {
  timers_[timer_index_[timer]].release_at(due);
  for (Waiting& waiting : waiting_) {
    if (waiting.timer == timer_index_[timer]) waiting.due = due;
  }
  std::make_heap(waiting_.begin(), waiting_.end(), later);
}

std::vector<CallbackGroupScheduler::Waiting> CallbackGroupScheduler::all_in_order() const {
  std::vector<Waiting> all;
  for (std::uint32_t timer = 0; timer < timers_.size(); ++timer) {
    const auto waiting = std::ranges::find(waiting_, timer, &Waiting::timer);
    const std::uint64_t last = waited_ + timer;
    all.push_back(waiting != waiting_.end() ? *waiting : Waiting{timers_[timer].due(), last, timer});
  }
  std::ranges::sort(all, [](const Waiting& a, const Waiting& b) { return later(b, a); });
  return all;
}

void CallbackGroupScheduler::released_by(Time now) {
  if (!any_delays_) return;
  std::vector<Waiting> all = all_in_order();
  hotpath::released_by(now, all, timers_, [](const Waiting& a, const Waiting& b) { return later(b, a); });
  for (Waiting& waiting : waiting_) waiting.due = timers_[waiting.timer].due();
  std::ranges::make_heap(waiting_, later);
}

Arrival CallbackGroupScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time now) {
  Arrival arrival;
  arrival.overwritten = add_unread(task, sample);
  arrival.wake = add_event(task, now);
  return arrival;
}

void CallbackGroupScheduler::describe(StateWords& words) const {
  for (const Timer& timer : timers_) timer.describe(words);
  std::vector<Waiting> in_order = waiting_;
  std::sort(in_order.begin(), in_order.end(), [](const Waiting& a, const Waiting& b) { return later(b, a); });
  words.add(static_cast<std::int64_t>(in_order.size()));
  for (const Waiting& w : in_order) words.add(w.timer);
  if (any_delays_) {
    std::ranges::sort(in_order, {},
                      &Waiting::order);  // decides between timers that become due at one instant
    for (const Waiting& w : in_order) words.add(w.timer);
    // The others may be released already, and wait as soon as their jobs have ended.
    for (const Waiting& w : all_in_order()) words.add(w.timer);
  }
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
    job = timers_[timer_index_[event.task]].call(now);
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
    decision.wake_at = waiting_.empty() ? kNever : waiting_.front().due;
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
  const bool removed = !task.local;
  if (task.always_due && task.kind == TaskKind::timer && !removed) timers_[timer_index_[job.task]].ended(now);
  if (task.kind == TaskKind::timer && !removed && manage(timer_index_[job.task])) {
    effect.wake.insert(timer_manager());
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
