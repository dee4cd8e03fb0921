// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/priority_events_queue.hpp"

#include <cassert>

namespace hotpath {

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
  sift_up(heap_.size() - 1, heap_.back());
}

Job PriorityEventsQueue::pop() {
  assert(!heap_.empty());
  const std::uint32_t slot = heap_.front().slot;
  const Entry last = heap_.back();
  heap_.pop_back();
  // The last entry is most likely one of the last to run: the gap at the top sinks to the bottom first, which
  // takes one comparison a level, and the entry hardly rises from there.
  const std::size_t size = heap_.size();
  std::size_t gap = 0;
  for (std::size_t child = 1; child < size; child = 2 * gap + 1) {
    // An addition in place of a branch that cannot be predicted.
    if (child + 1 < size) child += before(heap_[child + 1], heap_[child]);
    heap_[gap] = heap_[child];
    gap = child;
  }
  if (size > 0) sift_up(gap, last);
  free_.push_back(slot);
  return slots_[slot];
}

void PriorityEventsQueue::sift_up(std::size_t gap, Entry entry) {
  while (gap > 0) {
    const std::size_t parent = (gap - 1) / 2;
    if (!before(entry, heap_[parent])) break;
    heap_[gap] = heap_[parent];
    gap = parent;
  }
  heap_[gap] = entry;
}

void PriorityEventsQueue::for_each(const std::function<void(const Job&)>& visit) const {
  for (const Entry& e : heap_) visit(slots_[e.slot]);
}

}  // namespace hotpath
