// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/wait_mutex.hpp"
#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// What a poll does with tasks of the snapshot whose callback groups are busy.
enum class Blocked : std::uint8_t {
  forgotten,  ///< rclcpp up to 26 (Humble, Iron).
  kept,       ///< Ahead of what it finds: the remedy of Teper et al. (Thread Carefully, EMSOFT 2024).
};

/// rclcpp's SingleThreadedExecutor (one worker), and MultiThreadedExecutor (several) up to rclcpp 26
/// (executor.cpp, allocator_memory_strategy.hpp): at a polling point every ready timer and subscription is
/// entered once into a snapshot that all workers share; the processing window picks timers before
/// subscriptions, each in entity order, and `call()` happens at the pick. What becomes ready meanwhile waits
/// for the next poll. A mutually exclusive callback group with a running job is left out of polls and picks.
class WaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]; with one, no group is ever busy when it looks for work.
  WaitSetScheduler(const TaskSet& set, unsigned workers, Blocked blocked = Blocked::forgotten,
                   const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, workers, TaskKind::timer, entity_order), blocked_(blocked) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::unique_ptr<Scheduler> clone() const override {
    return workers().size() == 1 ? std::make_unique<WaitSetScheduler>(*this) : nullptr;
  }

 private:
  /// The interrupt guard condition, so that the task is in the wait.
  WorkerSet joined(TaskId) override { return wait_mutex_.waiting(); }
  std::optional<Job> pick(Time now);

  const Blocked blocked_;
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
