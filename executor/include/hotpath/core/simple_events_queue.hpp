// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/events_queue.hpp"

namespace hotpath {

/// First in, first out: the stock events executor's queue (rclcpp simple_events_queue.hpp), unbounded.
class SimpleEventsQueue final : public EventsQueue {
 public:
  /// `capacity`: number of jobs before the first allocation; a power of two.
  explicit SimpleEventsQueue(std::size_t capacity = 64) : ring_(capacity) {}
  void push(const Job& job) override;
  Job pop() override;
  std::optional<Job> pop_first(const std::function<bool(const Job&)>& may_run) override;
  bool empty() const override { return count_ == 0; }
  std::size_t size() const override { return count_; }
  void erase(TaskId task, const std::function<void(const Job&)>& erased) override;
  void for_each(const std::function<void(const Job&)>& visit) const override;
  std::unique_ptr<EventsQueue> clone() const override { return std::make_unique<SimpleEventsQueue>(*this); }
  void describe(StateWords& words) const override;

 private:
  std::vector<Job> ring_;  // size is a power of two
  std::size_t head_ = 0, count_ = 0;
};

}  // namespace hotpath
