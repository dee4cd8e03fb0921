// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/timers_manager.hpp"

#include <algorithm>
#include <cassert>

namespace hotpath {

void TimersManager::begin(const TaskSet& set, Time epoch) {
  *this = {};
  for (const TaskId id : set.timers())
    if (set[id].local) manage(id, set[id], epoch);
  std::sort(heap_.begin(), heap_.end(), before);  // a sorted array is a heap
}

void TimersManager::manage(TaskId id, const Task& task, Time epoch) {
  const auto timer = static_cast<std::uint32_t>(timers_.size());
  index_.resize(id + 1, 0);
  index_[id] = timer;
  any_delays_ |= timers_.emplace_back(id, task, epoch).has_delays();
  heap_.push_back({timers_.back().due(), waited_++, timer});
}

Timer TimersManager::remove(TaskId id) {
  Timer& timer = timers_[index_[id]];
  std::erase_if(heap_, [&](const Entry& e) { return e.timer == index_[id]; });
  std::sort(heap_.begin(), heap_.end(), before);
  const Timer removed = timer;
  timer.cancel();
  return removed;
}

void TimersManager::change(TaskId id, void (Timer::*step)(Time), Time now) {
  Timer& timer = timers_[index_[id]];
  (timer.*step)(now);
  for (Entry& entry : heap_) {
    if (entry.timer == index_[id]) entry.due = timer.due();
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

TaskId TimersManager::take_head() {
  std::pop_heap(heap_.begin(), heap_.end(), behind);
  const TaskId task = timers_[heap_.back().timer].task();
  heap_.pop_back();
  return task;
}

std::vector<TimersManager::Entry> TimersManager::all_in_order() const {
  std::vector<Entry> all = heap_;
  for (std::uint32_t timer = 0; timer < timers_.size(); ++timer) {
    if (std::ranges::find(heap_, timer, &Entry::timer) == heap_.end())
      all.push_back({timers_[timer].due(), waited_ + timer, timer});
  }
  std::sort(all.begin(), all.end(), before);
  return all;
}

void TimersManager::released_by(Time now) {
  if (!any_delays_) return;
  // Timestamps stay as they are: some schedule has this order.
  std::vector<Entry> all = all_in_order();
  for (std::size_t i = all.size(); i-- > 0;) {
    Entry& entry = all[i];
    Timer& timer = timers_[entry.timer];
    if (!timer.is_released()) continue;
    entry.due = std::min(entry.due, now);
    if (i + 1 < all.size() && !before(entry, all[i + 1])) {
      entry.due = all[i + 1].due;
      if (!before(entry, all[i + 1])) entry.due -= Duration(1);
    }
    timer.release_at(entry.due);
  }
  for (Entry& entry : heap_) entry.due = timers_[entry.timer].due();
  std::sort(heap_.begin(), heap_.end(), before);
}

void TimersManager::describe(StateWords& words) const {
  for (const Timer& timer : timers_) timer.describe(words);
  if (!any_delays_) return;
  // Those that are due were so at instants that other schedules reach in the same order; those that do not
  // wait may be released already, and wait as soon as their jobs have ended.
  for (const Entry& entry : all_in_order()) words.add(entry.timer);
}

void TimersManager::describe_waiting(StateWords& words) const {
  std::vector<Entry> in_order = heap_;
  std::sort(in_order.begin(), in_order.end(), before);
  words.add(static_cast<std::int64_t>(in_order.size()));
  for (const Entry& entry : in_order) words.add(entry.timer);
  if (!any_delays_) return;
  // Decides between timers that become due at one instant.
  std::ranges::sort(in_order, {}, &Entry::order);
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
