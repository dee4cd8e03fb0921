// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set.hpp"

namespace hotpath {

WaitSet::WaitSet(const TaskSet& set, unsigned workers)
    : set_(set), unread_(set), roles_(workers, WorkerRole::executor) {
  assert(workers >= 1 && workers <= kMaxWorkers);
  for (TaskId id = 0; id < set_.size(); ++id) {
    if (!set_[id].local) continue;
    (set_[id].kind == TaskKind::timer ? timer_ids_ : subscription_ids_).push_back(id);
  }
  ready_timers_.reserve(timer_ids_.size());
  ready_subscriptions_.reserve(subscription_ids_.size());
}

void WaitSet::begin(Time epoch) {
  timers_.clear();
  for (const TaskId id : timer_ids_) timers_.emplace_back(id, set_[id], epoch);
}

}  // namespace hotpath
