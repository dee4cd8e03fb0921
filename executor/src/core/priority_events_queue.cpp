// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/priority_events_queue.hpp"

#include <algorithm>
#include <cassert>

namespace hotpath {

namespace {
// The standard heap puts the largest element first; here the smallest key comes first.
constexpr auto runs_later = [](const auto& a, const auto& b) { return b.key < a.key; };
}  // namespace

void PriorityEventsQueue::push(const Job& job) {
  std::uint32_t slot;
  if (free_.empty()) {
    slot = static_cast<std::uint32_t>(slots_.size());
    slots_.push_back(job);
  } else {
    slot = free_.back();
    free_.pop_back();
    slots_[slot] = job;
  }
  heap_.push_back({order_.key(job, activations_++), slot});
  std::push_heap(heap_.begin(), heap_.end(), runs_later);
}

Job PriorityEventsQueue::pop() {
  assert(!heap_.empty());
  std::pop_heap(heap_.begin(), heap_.end(), runs_later);
  const std::uint32_t slot = heap_.back().slot;
  heap_.pop_back();
  free_.push_back(slot);
  return slots_[slot];
}

std::optional<Job> PriorityEventsQueue::pop_first(const std::function<bool(const Job&)>& may_run) {
  if (!heap_.empty() && may_run(slots_[heap_.front().slot])) return pop();
  // A sorted array is a heap, also without one of its elements.
  std::sort(heap_.begin(), heap_.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
  const auto first = std::find_if(heap_.begin() + (heap_.empty() ? 0 : 1), heap_.end(),
                                  [&](const Entry& e) { return may_run(slots_[e.slot]); });
  if (first == heap_.end()) return std::nullopt;
  const std::uint32_t slot = first->slot;
  heap_.erase(first);
  free_.push_back(slot);
  return slots_[slot];
}

void PriorityEventsQueue::erase(TaskId task, const std::function<void(const Job&)>& erased) {
  std::erase_if(heap_, [&](const Entry& e) {
    if (slots_[e.slot].task != task) return false;
    erased(slots_[e.slot]);
    free_.push_back(e.slot);
    return true;
  });
  std::make_heap(heap_.begin(), heap_.end(), runs_later);
}

void PriorityEventsQueue::describe(StateWords& words) const {
  std::vector<Entry> in_order = heap_;
  std::sort(in_order.begin(), in_order.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
  words.add(static_cast<std::int64_t>(in_order.size()));
  for (const Entry& e : in_order) {
    const Job& job = slots_[e.slot];
    words.add(job.task);
    if (is_of_timer(job)) words.add(job.timestamp);
    if (by_deadline()) words.add(job.deadline);
  }
}

void PriorityEventsQueue::for_each(const std::function<void(const Job&)>& visit) const {
  for (const Entry& e : heap_) visit(slots_[e.slot]);
}

}  // namespace hotpath
