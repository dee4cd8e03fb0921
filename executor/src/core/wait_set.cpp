// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set.hpp"

#include <cassert>

namespace hotpath {

WaitSet::WaitSet(const TaskSet& set, unsigned workers, TaskKind runs_first,
                 const std::vector<TaskId>& entity_order)
    : ExploredScheduler(set, workers, false),
      runs_first_(runs_first),
      timer_index_(set.size(), 0),
      snapshot_(set.size()),
      group_busy_(set.groups.size(), false) {
  assert(entity_order.empty() || entity_order.size() == set.size());
  for (const TaskId id : in_order_of_kinds(set_, entity_order, runs_first)) {
    if (!set_[id].local) continue;
    if (set_[id].kind == TaskKind::timer) {
      timer_index_[id] = static_cast<std::uint32_t>(timer_ids_.size());
      timer_ids_.push_back(id);
    } else {
      subscription_ids_.push_back(id);
    }
  }
  snapshot_.reserve(timer_ids_.size() + subscription_ids_.size());
}

Joined WaitSet::add_task(const JoiningTask& joining, Time now) {
  const TaskId id = join_set(joining);
  group_busy_.resize(set_.groups.size(), false);
  timer_index_.push_back(static_cast<std::uint32_t>(timer_ids_.size()));
  if (set_[id].kind == TaskKind::timer) {
    timer_ids_.push_back(id);
    timers_.emplace_back(id, set_[id], now);
  } else {
    const auto behind = std::ranges::find_if(subscription_ids_, [&](TaskId other) {
      return place_of_kind(set_[other], runs_first_) > place_of_kind(set_[id], runs_first_);
    });
    subscription_ids_.insert(behind, id);
  }
  snapshot_.add_task();
  snapshot_.reserve(timer_ids_.size() + subscription_ids_.size());
  return {id, joined(id)};
}

void WaitSet::remove_task(TaskId task, Time now, const Visitor& dropped) {
  if (set_[task].kind == TaskKind::timer) {
    visit_due(timer(task), now, dropped);
    timers_.erase(timers_.begin() + timer_index_[task]);
    std::erase(timer_ids_, task);
    for (std::uint32_t i = 0; i < timer_ids_.size(); ++i) timer_index_[timer_ids_[i]] = i;
  } else {
    std::erase(subscription_ids_, task);
  }
  drop_unread(task, dropped);
  snapshot_.erase(task);
  leave(changed_set(), task);
  left(task);
}

void WaitSet::describe(StateWords& words) const {
  for (const Timer& timer : timers_) timer.describe(words);
  for (const TaskId id : subscription_ids_) words.add(unread_.count(id));
  for (const TaskId id : snapshot_.tasks()) words.add(id);
  words.add(-1);
  for (const bool busy : group_busy_) words.add(busy ? 1 : 0);
}

void WaitSet::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : timer_ids_) timers_.emplace_back(id, set_[id], epoch);
}

}  // namespace hotpath
