// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/events_queue.hpp"

namespace hotpath {

/// The paper's priority-based events queue (Section IV): an unbounded binary heap over the priority
/// order, O(log n) per push and pop, and per job for pop_free(). Serves both as the events queue and
/// as the timer ready queue.
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
  /// Sets jobs of busy groups aside, each group's in a heap of its own, so that no later call looks
  /// at them until their group is free.
  std::optional<Job> pop_free(const TaskSet& set, const std::vector<bool>& busy) override;
  void group_freed(std::uint32_t group) override;
  bool empty() const override { return size() == 0; }
  std::size_t size() const override { return heap_.size() + aside_; }
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

  /// Removes the first element of a heap.
  static Entry take_first(std::vector<Entry>& heap);
  static void insert(std::vector<Entry>& heap, const Entry& entry);
  /// Frees the slot of an entry that is in no heap any more.
  Job job_of(const Entry& entry);
  /// Puts all jobs that were set aside back into the heap.
  void gather();

  PriorityOrder order_;
  std::vector<Entry> heap_;
  /// By callback group: a heap of jobs set aside. While a group is free, the first of its jobs is in
  /// `heap_`.
  std::vector<std::vector<Entry>> of_group_;
  std::size_t aside_ = 0;  ///< Number of jobs set aside.
  std::vector<Job> slots_;
  std::vector<std::uint32_t> free_;
  std::uint64_t activations_ = 0;
};

}  // namespace hotpath
