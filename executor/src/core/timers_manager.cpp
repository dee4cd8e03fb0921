// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/timers_manager.hpp"

#include <algorithm>
#include <cassert>

namespace hotpath {

void TimersManager::begin(const TaskSet& set, Time epoch) {
  timers_.clear();
  heap_.clear();
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer && set[id].local) timers_.emplace_back(id, set[id], epoch);
  }
  for (std::uint32_t i = 0; i < timers_.size(); ++i) heap_.push_back({timers_[i].next_call(), i});
  std::sort(heap_.begin(), heap_.end(), before);  // a sorted array is a heap
}

void TimersManager::add(TaskId id, const Task& task, Time epoch) {
  timers_.emplace_back(id, task, epoch);
  heap_.push_back({timers_.back().next_call(), static_cast<std::uint32_t>(timers_.size() - 1)});
  std::sort(heap_.begin(), heap_.end(), before);
}

Timer TimersManager::remove(TaskId id) {
  const auto entry =
      std::find_if(timers_.begin(), timers_.end(), [&](const Timer& t) { return t.task() == id; });
  assert(entry != timers_.end());
  std::erase_if(heap_, [&](const Entry& e) { return e.timer == entry - timers_.begin(); });
  std::sort(heap_.begin(), heap_.end(), before);
  const Timer removed = *entry;
  entry->cancel();
  return removed;
}

void TimersManager::ended(TaskId id, Time now) {
  for (Entry& entry : heap_) {
    Timer& timer = timers_[entry.timer];
    if (timer.task() != id) continue;
    timer.ended(now);
    entry.next_call = now;
  }
  std::sort(heap_.begin(), heap_.end(), before);
}

Job TimersManager::call_head(Time now) {
  assert(due(now));
  Entry& head = heap_.front();
  Timer& timer = timers_[head.timer];
  const Job job = timer.call(now);
  head.next_call = timer.next_call();
  sift_down(0);
  return job;
}

std::optional<Job> TimersManager::call_first(Time now, const std::function<bool(TaskId)>& may_run) {
  std::sort(heap_.begin(), heap_.end(), before);
  const auto entry = std::find_if(heap_.begin(), heap_.end(), [&](const Entry& e) {
    return e.next_call > now || may_run(timers_[e.timer].task());
  });
  if (entry == heap_.end() || entry->next_call > now) return std::nullopt;
  const Job job = timers_[entry->timer].call(now);
  entry->next_call = timers_[entry->timer].next_call();
  std::sort(heap_.begin(), heap_.end(), before);
  return job;
}

void TimersManager::sift_down(std::size_t i) {
  const Entry moving = heap_[i];
  for (;;) {
    std::size_t child = 2 * i + 1;
    if (child >= heap_.size()) break;
    if (child + 1 < heap_.size() && before(heap_[child + 1], heap_[child])) ++child;
    if (!before(heap_[child], moving)) break;
    heap_[i] = heap_[child];
    i = child;
  }
  heap_[i] = moving;
}

}  // namespace hotpath
