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
  /// Removes the job that runs next. The queue must not be empty.
  [[nodiscard]] virtual Job pop() = 0;
  /// Removes the first job, in execution order, for which `may_run` is true; std::nullopt if there
  /// is none. O(n), and more for an order by priority.
  [[nodiscard]] virtual std::optional<Job> pop_first(const std::function<bool(const Job&)>& may_run) = 0;
  /// Removes the first job, in execution order, whose callback group is not `busy`; std::nullopt if
  /// there is none. The same set and groups in each call; group_freed() reports each group that is
  /// busy no more.
  [[nodiscard]] virtual std::optional<Job> pop_free(const TaskSet& set, const std::vector<bool>& busy) {
    return pop_first([&](const Job& job) { return !busy[set[job.task].group]; });
  }
  virtual void group_freed(std::uint32_t group) { static_cast<void>(group); }
  [[nodiscard]] virtual bool empty() const = 0;
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Removes the jobs of a task and visits them, in no particular order.
  virtual void erase(TaskId task, const std::function<void(const Job&)>& erased) = 0;
  /// Orders jobs pushed from now on by this set; queued jobs keep their place.
  virtual void tasks_changed(const TaskSet& set) { static_cast<void>(set); }
  /// Visits all jobs, in no particular order.
  virtual void for_each(const std::function<void(const Job&)>& visit) const = 0;
  [[nodiscard]] virtual std::unique_ptr<EventsQueue> clone() const = 0;
  /// Adds the jobs in the order in which they would run.
  virtual void describe(StateWords& words) const = 0;
  /// Whether subscriptions are ordered by the deadlines that they inherit.
  [[nodiscard]] virtual bool by_deadline() const { return false; }
};

}  // namespace hotpath
