// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/priority_order.hpp"

namespace hotpath {

namespace {

constexpr std::int64_t kAheadOfTimers = std::numeric_limits<std::int64_t>::min();
constexpr std::uint64_t kTimerBit = std::uint64_t{1} << 63;

std::int64_t own_level(const Task& task, Policy policy) {
  return task.always_due && policy != Policy::fp ? kLowestLevel : traits_of(policy).own(task);
}

}  // namespace

std::vector<TaskId> most_urgent_timers(const TaskSet& set, Policy policy) {
  std::vector<TaskId> urgent(set.size(), kNoTask), timers = set.timers();
  for (const TaskId id : timers) urgent[id] = id;
  // Most urgent timer first: the first timer that reaches a subscription sets its level.
  std::ranges::stable_sort(timers, {}, [&](TaskId id) { return own_level(set[id], policy); });
  std::vector<TaskId> pending;
  for (const TaskId root : timers) {
    pending.assign(1, root);
    while (!pending.empty()) {
      const TaskId id = pending.back();
      pending.pop_back();
      for (const TaskId next : set[id].feeds) {
        if (urgent[next] != kNoTask) continue;
        urgent[next] = root;
        pending.push_back(next);
      }
    }
  }
  return urgent;
}

std::vector<std::int64_t> inherited_levels(const TaskSet& set, Policy policy) {
  const std::vector<TaskId> urgent = most_urgent_timers(set, policy);
  std::vector<std::int64_t> level(set.size(), kLowestLevel);
  for (TaskId id = 0; id < set.size(); ++id) {
    const bool given = policy == Policy::fp && set[id].kind == TaskKind::subscription && set[id].priority;
    if (given) {
      level[id] = *set[id].priority;
    } else if (urgent[id] != kNoTask) {
      level[id] = own_level(set[urgent[id]], policy);
    }
  }
  return level;
}

PriorityOrder::PriorityOrder(const TaskSet& set, Policy policy, SubscriptionRule rule, Ties ties)
    : traits_(&traits_of(policy)), ties_(ties), rule_(rule) {
  update(set);
}

void PriorityOrder::update(const TaskSet& set) {
  level_ = inherited_levels(set, traits_->value);
  kind_.clear();
  always_due_.clear();
  for (const Task& task : set.tasks) {
    kind_.push_back(task.kind);
    always_due_.push_back(task.always_due);
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    if (by_deadline(traits_->levels)) level_[id] = traits_->own(set[id]);  // deadlines alone are inherited
    if (rule_ == SubscriptionRule::first && kind_[id] == TaskKind::subscription) level_[id] = kAheadOfTimers;
  }
}

PriorityKey PriorityOrder::key(const Job& job, std::uint64_t activation) const {
  if (traits_->levels == Levels::arrival) return {0, activation};
  const bool timer = kind_[job.task] == TaskKind::timer;
  PriorityKey key{.priority = level_[job.task]};
  if (by_inherited_deadline() || (timer && by_deadline(traits_->levels))) key.priority += to_ns(job.deadline);
  if (ties_ == Ties::fifo) {
    key.tie = activation;
  } else if (timer && always_due_[job.task]) {
    // Always-due timers come last and take turns.
    key.tie = kTimerBit | (std::uint64_t{0x7fffffffU} << 32) | (activation & 0xffffffffU);
  } else if (timer) {
    // Task id (31 bits), then timestamp (32 bits). Beyond 2^32 timestamps of one timer the order of
    // tasks still holds, and sequences of queued jobs of one task differ by less than 2^32.
    key.tie = kTimerBit | (std::uint64_t{job.task & 0x7fffffffU} << 32) | (job.sequence & 0xffffffffU);
  } else {
    key.tie = kTimerBit - 1 - activation;
  }
  return key;
}

}  // namespace hotpath
