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
  for (std::uint32_t i = 0; i < timers_.size(); ++i) heap_.push_back({timers_[i].due(), i});
  std::sort(heap_.begin(), heap_.end(), before);  // a sorted array is a heap
}

void TimersManager::add(TaskId id, const Task& task, Time epoch) {
  timers_.emplace_back(id, task, epoch);
  heap_.push_back({timers_.back().due(), static_cast<std::uint32_t>(timers_.size() - 1)});
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

void TimersManager::change(TaskId id, void (Timer::*step)(Time), Time now) {
  for (Entry& entry : heap_) {
    Timer& timer = timers_[entry.timer];
    if (timer.task() != id) continue;
    (timer.*step)(now);
    entry.due = timer.due();
  }
  std::sort(heap_.begin(), heap_.end(), before);
}

Job TimersManager::call_head(Time now) {
  assert(due(now));
  Entry& head = heap_.front();
  Timer& timer = timers_[head.timer];
  const Job job = timer.call(now);
  head.due = timer.due();
  sift_down(0);
  return job;
}

std::optional<Job> TimersManager::call_first(Time now, const std::function<bool(TaskId)>& may_run) {
  std::sort(heap_.begin(), heap_.end(), before);
  const auto entry = std::find_if(heap_.begin(), heap_.end(), [&](const Entry& e) {
    return e.due > now || may_run(timers_[e.timer].task());
  });
  if (entry == heap_.end() || entry->due > now) return std::nullopt;
  const Job job = timers_[entry->timer].call(now);
  entry->due = timers_[entry->timer].due();
  std::sort(heap_.begin(), heap_.end(), before);
  return job;
}

void TimersManager::released_by(Time now) {
  std::sort(heap_.begin(), heap_.end(), before);
  hotpath::released_by(now, heap_, timers_, before);
}

void TimersManager::describe(StateWords& words) const {
  bool any_delays = false;
  for (const Timer& timer : timers_) {
    timer.describe(words);
    any_delays |= timer.has_delays();
  }
  if (!any_delays) return;
  // Those that are due were so at instants that other schedules reach in the same order.
  std::vector<Entry> in_order = heap_;
  std::sort(in_order.begin(), in_order.end(), before);
  for (const Entry& entry : in_order) words.add(entry.timer);
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
