// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/events_queue.hpp"

namespace hotpath {

/// The paper's priority-based events queue (Section IV): an unbounded binary heap over the priority
/// order, O(log n) per push and pop. Serves both as the events queue and as the timer ready queue.
class PriorityEventsQueue final : public EventsQueue {
 public:
  explicit PriorityEventsQueue(PriorityOrder order) : order_(std::move(order)) {
    heap_.reserve(kReserved);
    slots_.reserve(kReserved);
    free_.reserve(kReserved);
  }
  void push(const Job& job) override;
  Job pop() override;
  std::optional<Job> pop_first(const std::function<bool(const Job&)>& may_run) override;
  bool empty() const override { return heap_.empty(); }
  std::size_t size() const override { return heap_.size(); }
  void erase(TaskId task, const std::function<void(const Job&)>& erased) override;
  void tasks_changed(const TaskSet& set) override { order_.update(set); }
  void for_each(const std::function<void(const Job&)>& visit) const override;
  std::unique_ptr<EventsQueue> clone() const override { return std::make_unique<PriorityEventsQueue>(*this); }
  void describe(StateWords& words) const override;
  bool by_deadline() const override { return order_.by_inherited_deadline(); }

 private:
  // The heap moves keys and slot numbers; jobs stay where they are.
  struct Entry {
    PriorityKey key;
    std::uint32_t slot;
  };
  static constexpr std::size_t kReserved = 64;  ///< Jobs before the first allocation.
  PriorityOrder order_;
  std::vector<Entry> heap_;
  std::vector<Job> slots_;
  std::vector<std::uint32_t> free_;
  std::uint64_t activations_ = 0;
};

}  // namespace hotpath
