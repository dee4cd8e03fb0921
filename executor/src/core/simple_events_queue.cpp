// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/simple_events_queue.hpp"

#include <cassert>

namespace hotpath {

void SimpleEventsQueue::push(const Job& job) {
  if (count_ == ring_.size()) {
    std::vector<Job> larger(2 * ring_.size());
    for (std::size_t i = 0; i < count_; ++i) larger[i] = ring_[(head_ + i) & (ring_.size() - 1)];
    ring_.swap(larger);
    head_ = 0;
  }
  ring_[(head_ + count_) & (ring_.size() - 1)] = job;
  ++count_;
}

Job SimpleEventsQueue::pop() {
  assert(count_ > 0);
  const Job job = ring_[head_];
  head_ = (head_ + 1) & (ring_.size() - 1);
  --count_;
  return job;
}

std::optional<Job> SimpleEventsQueue::pop_first(const std::function<bool(const Job&)>& may_run) {
  std::optional<Job> first;
  for (std::size_t left = count_; left > 0; --left) {
    const Job job = pop();
    !first&& may_run(job) ? static_cast<void>(first = job) : push(job);
  }
  return first;
}

void SimpleEventsQueue::erase(TaskId task, const std::function<void(const Job&)>& erased) {
  for (std::size_t left = count_; left > 0; --left) {
    const Job job = pop();
    job.task == task ? erased(job) : push(job);
  }
}

void SimpleEventsQueue::for_each(const std::function<void(const Job&)>& visit) const {
  for (std::size_t i = 0; i < count_; ++i) visit(ring_[(head_ + i) & (ring_.size() - 1)]);
}

void SimpleEventsQueue::describe(StateWords& words) const {
  words.add(static_cast<std::int64_t>(count_));
  for (std::size_t i = 0; i < count_; ++i) {
    const Job& job = ring_[(head_ + i) & (ring_.size() - 1)];
    words.add(job.task);
    if (is_of_timer(job)) words.add(job.timestamp);
  }
}

}  // namespace hotpath
