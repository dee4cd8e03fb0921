// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// rclcpp's SingleThreadedExecutor (one worker) and MultiThreadedExecutor (several), rclcpp 26.0.0
/// executor.cpp and allocator_memory_strategy.hpp: at a polling point every ready timer and subscription is
/// entered once into a snapshot that all workers share; the processing window picks timers before
/// subscriptions, each in creation order, and `call()` happens at the pick. What becomes ready meanwhile
/// waits for the next poll. A mutually exclusive callback group with a running job is left out of polls and
/// picks.
class WaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers].
  WaitSetScheduler(const TaskSet& set, unsigned workers)
      : WaitSet(set, workers), group_busy_(set.groups.size(), false) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;

 private:
  [[nodiscard]] bool group_free(TaskId task) const { return !group_busy_[set_.tasks[task].group]; }
  std::optional<Job> pick(Time now);

  std::vector<bool> group_busy_;
  WorkerSet idle_;
  // Of the idle workers only one sleeps in rcl_wait; the others queue on its mutex
  // (multi_threaded_executor.cpp).
  std::optional<Worker> waiting_;
};

}  // namespace hotpath
