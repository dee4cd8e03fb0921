// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

#include <algorithm>
#include <cassert>
#include <map>

namespace hotpath {

namespace {

/// Jobs end in one round in the order of their threads' numbers, which matters if two of them may publish to
/// one subscription. Idle threads queue in that order, too, which matters if one of them was woken and has
/// not looked for work yet when another begins to queue behind a third and a fourth one finds a job.
bool are_alike(const TaskSet& set, unsigned threads) {
  std::map<TaskId, std::uint32_t> publishers;  // by subscription: their group
  for (const Task& task : set.tasks) {
    if (set.groups[task.group] == CallbackGroup::reentrant) return false;
    for (const TaskId reader : task.feeds)
      if (publishers.try_emplace(reader, task.group).first->second != task.group) return false;
  }
  return threads <= 3;
}

}  // namespace

WaitSet::WaitSet(const TaskSet& set, unsigned workers, TaskKind runs_first,
                 const std::vector<TaskId>& entity_order, Asked asked)
    : ExploredScheduler(set, workers, false),
      group_busy_(set.groups.size(), false),
      runs_first_(runs_first),
      asked_(asked),
      snapshot_(set.size()) {
  assert(entity_order.empty() || entity_order.size() == set.size());
  entities_ = in_order_of_kinds(set_, entity_order, runs_first);
  std::erase_if(entities_, [this](TaskId id) { return !set_[id].local; });
  snapshot_.reserve(entities_.size());
  number_places();
  threads_alike_ = are_alike(set_, workers);
}

Joined WaitSet::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join_set(joining);
  group_busy_.resize(set_.groups.size(), false);
  if (set_[id].kind == TaskKind::timer) timers_.emplace_back(id, set_[id], now);
  const auto behind = std::ranges::find_if(entities_, [&](TaskId other) {
    return place_of_kind(set_[other], runs_first_) > place_of_kind(set_[id], runs_first_);
  });
  entities_.insert(behind, id);
  number_places();
  snapshot_.add_task();
  snapshot_.reserve(entities_.size());
  return {id, joined(id)};
}

void WaitSet::remove_task(TaskId task, Time now, const Visitor& dropped) {
  if (set_[task].kind == TaskKind::timer) {
    visit_due(timer(task), now, dropped);
    timers_.erase(timers_.begin() + timer_number(task));
  }
  std::erase(entities_, task);
  drop_unread(task, dropped);
  number_places();
  snapshot_.erase(task);
  leave(changed_set(), task);
  left(task);
}

void WaitSet::describe(StateWords& words) const {
  for (const Timer& timer : timers_) timer.describe(words);
  for (const TaskId id : entities_) {
    if (unread_.is_subscription(id)) words.add(unread_.count(id));
  }
  for (const TaskId id : snapshot_.tasks()) words.add(id);
  words.add(-1);
  for (const std::uint8_t busy : group_busy_) words.add(busy);
}

void WaitSet::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : entities_) {
    if (set_[id].kind == TaskKind::timer) timers_.emplace_back(id, set_[id], epoch);
  }
}

void WaitSet::number_places() {
  place_.resize(set_.size());
  ready_ = NumberSet(entities_.size());
  for (std::uint32_t place = 0; place < entities_.size(); ++place) {
    const TaskId id = entities_[place];
    place_[id] = place;
    if (unread_.count(id) > 0 || is_asked_at_turn(id)) ready_.insert(place);
  }
  const auto timer =
      std::ranges::find(entities_, TaskKind::timer, [this](TaskId id) { return set_[id].kind; });
  first_timer_ = static_cast<std::uint32_t>(timer - entities_.begin());
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  // A recorded schedule shows who had the mutex, and when waits ended.
  const bool shared = workers().size() > 1 && !follows();
  Decision decision;  // one for all returns, so that none is copied
  decision.blocked = shared && wait_mutex_.blocks(worker);
  if (decision.blocked) return decision;
  const bool slept = wait_mutex_.enter(worker);
  if (slept) poll(now, [this](TaskId id) { return is_waited_for(id); });
  pick(now, decision);
  if (!decision.job && shared) {
    begin_wait(worker, now, decision);
    return decision;
  }
  if (!decision.job) {
    if (blocked_ == Blocked::forgotten) forget_snapshot();
    const std::uint32_t tasks = poll(now, [this](TaskId id) { return group_free(id); });
    pick(now, decision);
    if (decision.job && !slept) decision.waited_for = tasks;
  }
  if (decision.job) {
    decision.wake = wait_mutex_.next();
  } else if (wait_mutex_.wait(worker)) {
    decision.wake_at = next_timer([this](TaskId id) { return group_free(id); });
  }
  return decision;
}

void WaitSetScheduler::begin_wait(Worker worker, Time now, Decision& decision) {
  if (blocked_ == Blocked::forgotten) forget_snapshot();
  wait_mutex_.wait(worker);
  left_out_ = group_busy_;
  decision.waited_for = static_cast<std::uint32_t>(entities().size());
  const bool has_sample =
      std::ranges::any_of(entities(), [&](TaskId id) { return unread_.count(id) > 0 && group_free(id); });
  decision.wake_at = has_sample ? now : next_timer([this](TaskId id) { return group_free(id); });
}

Decision StaticScheduler::decide(Worker, Time now) {
  if (runs_ == Runs::one) forget_snapshot();
  Decision decision;
  next_ready(now, decision);
  if (!decision.job) {
    forget_snapshot();
    const std::uint32_t tasks = poll(now, [](TaskId) { return true; });
    next_ready(now, decision);
    if (!sleeps_ && decision.job) decision.waited_for = tasks;
  }
  sleeps_ = !decision.job;
  if (sleeps_) decision.wake_at = next_timer([](TaskId) { return true; });
  return decision;
}

RebuiltWaitSetScheduler::RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers, Asked asked,
                                                 const std::vector<TaskId>& entity_order)
    : WaitSet(set, workers, TaskKind::timer, entity_order, asked),
      waited_(entities()),
      is_waited_for_(set.size(), true) {}

void RebuiltWaitSetScheduler::describe(StateWords& words) const {
  WaitSet::describe(words);
  if (!threads_alike()) wait_mutex_.describe(words);
  words.add((interrupted_ ? 1 : 0) + (needs_rebuild_ ? 2 : 0));
  words.add(static_cast<std::int64_t>(waited_.size()));
  for (const TaskId id : waited_) words.add(id);
}

void RebuiltWaitSetScheduler::rebuild() {
  needs_rebuild_ = false;
  std::erase_if(waited_, [this](TaskId id) {
    if (group_free(id)) return false;
    is_waited_for_[id] = false;
    return true;
  });
  const auto before = static_cast<std::ptrdiff_t>(waited_.size());
  for (const TaskId id : entities()) {
    if (is_waited_for_[id] || !group_free(id)) continue;
    is_waited_for_[id] = true;
    waited_.push_back(id);
  }
  std::sort(waited_.begin() + before, waited_.end(), std::greater<>());
  std::ranges::stable_sort(waited_, {},
                           [this](TaskId id) { return place_of_kind(set_[id], TaskKind::timer); });
}

void RebuiltWaitSetScheduler::wait(Time now, Decision& decision) {
  forget_snapshot();
  for (const TaskId id : waited_) poll_task(id, now);
  if (std::exchange(interrupted_, false)) needs_rebuild_ = true;
  pick(now, decision);
}

Decision RebuiltWaitSetScheduler::decide(Worker worker, Time now) {
  // A worker that slept returns from its wait.
  Decision decision;
  wait_mutex_.enter(worker) ? wait(now, decision) : pick(now, decision);
  while (!decision.job) {
    if (needs_rebuild_) rebuild();
    decision.waited_for = static_cast<std::uint32_t>(waited_.size());
    wait(now, decision);
    if (!needs_rebuild_) break;
  }
  if (decision.job) {
    decision.wake = wait_mutex_.next();
  } else if (wait_mutex_.wait(worker)) {
    decision.wake_at =
        next_timer([this, now](TaskId id) { return is_waited_for_[id] && !is_ready(id, now); });
  } else {
    decision.waited_for = 0;  // it only queues for the mutex of the worker that waits
  }
  return decision;
}

Effect RebuiltWaitSetScheduler::finished(Worker, const Job& job, Time) {
  if (set_.groups[set_.tasks[job.task].group] == CallbackGroup::reentrant) return {};
  free_group(job.task);
  interrupted_ = true;
  return {wait_mutex_.waiting()};
}

}  // namespace hotpath
