// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/events_queue.hpp"

#include <algorithm>
#include <cassert>

namespace hotpath {

namespace {

// The standard heap puts the largest element first; here the smallest key comes first.
constexpr auto runs_later = [](const auto& a, const auto& b) { return b.key < a.key; };

void describe_job(const Job& job, StateWords& words) {
  words.add(job.task);
  if (is_of_timer(job)) words.add(job.timestamp);
}

}  // namespace

void SimpleEventsQueue::push(const Job& job) {
  if (count_ == ring_.size()) {
    std::vector<Job> larger(2 * ring_.size());
    for (std::size_t i = 0; i < count_; ++i) larger[i] = ring_[place(i)];
    ring_.swap(larger);
    head_ = 0;
  }
  ring_[place(count_)] = job;
  ++count_;
}

const Job& SimpleEventsQueue::pop() {
  assert(count_ > 0);
  const Job& job = ring_[head_];
  head_ = place(1);
  --count_;
  return job;
}

const Job* SimpleEventsQueue::pop_first(const std::function<bool(const Job&)>& may_run) {
  std::size_t i = 0;
  while (i < count_ && !may_run(ring_[place(i)])) ++i;
  if (i == count_) return nullptr;
  for (; i > 0; --i) std::swap(ring_[place(i)], ring_[place(i - 1)]);
  return &pop();
}

void SimpleEventsQueue::erase(TaskId task, const std::function<void(const Job&)>& erased) {
  for (std::size_t left = count_; left > 0; --left) {
    const Job job = pop();
    job.task == task ? erased(job) : push(job);
  }
}

void SimpleEventsQueue::describe(StateWords& words) const {
  words.add(static_cast<std::int64_t>(count_));
  for_each([&](const Job& job) { describe_job(job, words); });
}

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
  insert(heap_, {order_.key(job, activations_++), slot});
}

PriorityEventsQueue::Entry PriorityEventsQueue::take_first(std::vector<Entry>& heap) {
  std::pop_heap(heap.begin(), heap.end(), runs_later);
  const Entry first = heap.back();
  heap.pop_back();
  return first;
}

void PriorityEventsQueue::insert(std::vector<Entry>& heap, const Entry& entry) {
  heap.push_back(entry);
  std::push_heap(heap.begin(), heap.end(), runs_later);
}

void PriorityEventsQueue::gather() {
  if (aside_ == 0) return;
  for (std::vector<Entry>& aside : of_group_) {
    heap_.insert(heap_.end(), aside.begin(), aside.end());
    aside.clear();
  }
  aside_ = 0;
  std::make_heap(heap_.begin(), heap_.end(), runs_later);
}

const Job& PriorityEventsQueue::pop() {
  gather();
  assert(!heap_.empty());
  return job_of(take_first(heap_));
}

const Job* PriorityEventsQueue::pop_free(const TaskSet& set, const std::vector<bool>& busy) {
  while (!heap_.empty()) {
    const Entry first = take_first(heap_);
    const std::uint32_t group = set[slots_[first.slot].task].group;
    if (!busy[group]) return &job_of(first);
    if (group >= of_group_.size()) of_group_.resize(busy.size());
    insert(of_group_[group], first);
    ++aside_;
  }
  return nullptr;
}

void PriorityEventsQueue::group_freed(std::uint32_t group) {
  if (group >= of_group_.size() || of_group_[group].empty()) return;
  insert(heap_, take_first(of_group_[group]));
  --aside_;
}

const Job* PriorityEventsQueue::pop_first(const std::function<bool(const Job&)>& may_run) {
  gather();
  if (heap_.empty()) return nullptr;
  if (may_run(slots_[heap_.front().slot])) return &pop();
  // A sorted array is a heap, also without one of its elements.
  std::sort(heap_.begin(), heap_.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
  const auto first =
      std::find_if(heap_.begin() + 1, heap_.end(), [&](const Entry& e) { return may_run(slots_[e.slot]); });
  if (first == heap_.end()) return nullptr;
  const Entry entry = *first;
  heap_.erase(first);
  return &job_of(entry);
}

void PriorityEventsQueue::erase(TaskId task, const std::function<void(const Job&)>& erased) {
  gather();
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
  for (const std::vector<Entry>& aside : of_group_) {
    in_order.insert(in_order.end(), aside.begin(), aside.end());
  }
  std::sort(in_order.begin(), in_order.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
  words.add(static_cast<std::int64_t>(in_order.size()));
  for (const Entry& e : in_order) {
    const Job& job = slots_[e.slot];
    describe_job(job, words);
    if (by_deadline()) words.add(job.deadline);
  }
}

void PriorityEventsQueue::for_each(const std::function<void(const Job&)>& visit) const {
  for (const Entry& e : heap_) visit(slots_[e.slot]);
  for (const std::vector<Entry>& aside : of_group_) {
    for (const Entry& e : aside) visit(slots_[e.slot]);
  }
}

}  // namespace hotpath
