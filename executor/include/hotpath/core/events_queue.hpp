// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/state_words.hpp"

namespace hotpath {

/// Released jobs that have not started (rclcpp
/// experimental/executors/events_executor/events_queue.hpp).
class EventsQueue {
 public:
  virtual ~EventsQueue() = default;
  virtual void push(const Job& job) = 0;
  /// Removes the job that runs next; it stays where it is until the next call. The queue must not be empty.
  [[nodiscard]] virtual const Job& pop() = 0;
  /// Removes the first job, in execution order, for which `may_run` is true; nullptr if there is none.
  /// O(n), and more for an order by priority.
  [[nodiscard]] virtual const Job* pop_first(const std::function<bool(const Job&)>& may_run) = 0;
  /// Removes the first job, in execution order, whose callback group is not `busy`; nullptr if there is
  /// none. The same set and groups in each call; group_freed() reports each group that is busy no more.
  [[nodiscard]] virtual const Job* pop_free(const TaskSet& set, const std::vector<bool>& busy) {
    return pop_first([&](const Job& job) { return !busy[set[job.task].group]; });
  }
  virtual void group_freed(std::uint32_t /*group*/) {}
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Removes the jobs of a task and visits them, in no particular order.
  virtual void erase(TaskId task, const std::function<void(const Job&)>& erased) = 0;
  /// Orders jobs pushed from now on by this set; queued jobs keep their place.
  virtual void tasks_changed(const TaskSet& /*set*/) {}
  /// Visits all jobs, in no particular order.
  virtual void for_each(const std::function<void(const Job&)>& visit) const = 0;
  [[nodiscard]] virtual std::unique_ptr<EventsQueue> clone() const = 0;
  /// Adds the jobs in the order in which they would run.
  virtual void describe(StateWords& words) const = 0;
  /// Whether subscriptions are ordered by the deadlines that they inherit.
  [[nodiscard]] virtual bool by_deadline() const { return false; }
};

/// First in, first out: the stock events executor's queue (rclcpp simple_events_queue.hpp), unbounded.
class SimpleEventsQueue final : public EventsQueue {
 public:
  /// `capacity`: number of jobs before the first allocation; a power of two.
  explicit SimpleEventsQueue(std::size_t capacity = 64) : ring_(capacity) {}
  void push(const Job& job) override;
  const Job& pop() override;
  const Job* pop_first(const std::function<bool(const Job&)>& may_run) override;
  std::size_t size() const override { return count_; }
  void erase(TaskId task, const std::function<void(const Job&)>& erased) override;
  void for_each(const std::function<void(const Job&)>& visit) const override {
    for (std::size_t i = 0; i < count_; ++i) visit(ring_[place(i)]);
  }
  std::unique_ptr<EventsQueue> clone() const override { return std::make_unique<SimpleEventsQueue>(*this); }
  void describe(StateWords& words) const override;

 private:
  [[nodiscard]] std::size_t place(std::size_t i) const { return (head_ + i) & (ring_.size() - 1); }

  std::vector<Job> ring_;  // size is a power of two
  std::size_t head_ = 0, count_ = 0;
};

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
  const Job& pop() override;
  const Job* pop_first(const std::function<bool(const Job&)>& may_run) override;
  /// Sets jobs of busy groups aside, each group's in a heap of its own, so that no later call looks
  /// at them until their group is free.
  const Job* pop_free(const TaskSet& set, const std::vector<bool>& busy) override;
  void group_freed(std::uint32_t group) override;
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
  const Job& job_of(const Entry& entry) {
    free_.push_back(entry.slot);
    return slots_[entry.slot];
  }
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
