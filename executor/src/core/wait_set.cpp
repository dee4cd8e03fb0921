// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set.hpp"

#include <cassert>

namespace hotpath {

WaitSet::WaitSet(const TaskSet& set, unsigned workers, TaskKind runs_first,
                 const std::vector<TaskId>& entity_order)
    : set_(set),
      unread_(set),
      roles_(workers, WorkerRole::executor),
      runs_first_(runs_first),
      timer_index_(set.size(), 0),
      snapshot_(set.size()),
      group_busy_(set.groups.size(), false) {
  assert(workers >= 1 && workers <= kMaxWorkers);
  assert(entity_order.empty() || entity_order.size() == set.size());
  for (TaskId i = 0; i < set_.size(); ++i) {
    const TaskId id = entity_order.empty() ? i : entity_order[i];
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

void WaitSet::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : timer_ids_) timers_.emplace_back(id, set_[id], epoch);
}

}  // namespace hotpath
