// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/wait_mutex.hpp"
#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// How a poll treats tasks of the snapshot whose callback groups are busy.
enum class Blocked : std::uint8_t {
  forgotten,  ///< rclcpp up to 26 (Humble, Iron).
  kept,  ///< Kept ahead of newly found tasks: the remedy of Teper et al. (Thread Carefully, EMSOFT 2024).
};

/// rclcpp's SingleThreadedExecutor (one worker), and MultiThreadedExecutor (several) up to rclcpp
/// 26 (executor.cpp, allocator_memory_strategy.hpp). At a polling point every ready timer and
/// subscription enters the snapshot once; all workers share it. The processing window picks timers
/// before subscriptions, each in entity order, and `call()` happens at the pick. Tasks that become
/// ready meanwhile wait for the next poll. Polls and picks leave out a mutually exclusive callback
/// group with a running job.
class WaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]; with one worker no group is ever busy when it looks for work.
  WaitSetScheduler(const TaskSet& set, unsigned workers, Blocked blocked = Blocked::forgotten,
                   const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, workers, TaskKind::timer, entity_order), blocked_(blocked) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return workers().size() == 1 ? std::make_unique<WaitSetScheduler>(*this) : nullptr;
  }

 private:
  /// The interrupt guard condition ends the wait, so that the next one includes the task.
  WorkerSet joined(TaskId) override { return wait_mutex_.waiting(); }
  std::optional<Job> pick(Time now);
  /// A worker of several asks again at the end of the wait, because only then rcl_wait looks what is
  /// ready: samples of other workers arrive meanwhile.
  Decision begin_wait(Worker worker, Time now);
  /// Whether the wait set of the sleeping worker has the task.
  [[nodiscard]] bool is_waited_for(TaskId task) const {
    const std::uint32_t group = set_.tasks[task].group;
    return workers().size() == 1 || follows() || (group < left_out_.size() && !left_out_[group]);
  }

  const Blocked blocked_;
  std::vector<bool> left_out_;  // by callback group: busy when the wait began
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
