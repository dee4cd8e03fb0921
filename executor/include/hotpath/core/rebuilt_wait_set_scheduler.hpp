// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/wait_mutex.hpp"
#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// rclcpp's MultiThreadedExecutor from 28 on (Jazzy; executor.cpp, wait_result.hpp,
/// executor_entities_collection.cpp, multi_threaded_executor.cpp). The wait set outlives the wait.
/// When a job of a mutually exclusive group ends, it triggers a guard condition, which ends the
/// wait and makes the executor rebuild the wait set before the next wait. The rebuild removes
/// groups that are busy then and appends groups that have become free, so the order in the wait set
/// keeps changing. That prevents the starvation that occurs under rclcpp 26.
///
/// Between two rebuilds the wait set contains tasks whose group is busy. A blocked timer stays in
/// the snapshot; a blocked subscription leaves it until the next poll. An rclcpp worker that finds
/// only blocked tasks polls again and again until something changes; here it sleeps until then.
class RebuiltWaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]. Tasks that are appended to the wait set together appear in
  /// reverse order of creation: rclcpp takes them from hash maps that iterate from the last
  /// insertion.
  RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers, const std::vector<TaskId>& entity_order = {});

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;

 private:
  WorkerSet joined(TaskId task) override;
  void left(TaskId task) override;
  std::optional<Job> pick(Time now);
  std::optional<Job> wait(Time now);
  void rebuild();
  void rebuild(std::vector<TaskId>& waited, const std::vector<TaskId>& all);

  std::vector<TaskId> waited_timers_, waited_subscriptions_;  // in the order of the wait set
  std::vector<bool> is_waited_for_;                           // by task
  bool interrupted_ = false;                                  // whether the guard condition is triggered
  bool needs_rebuild_ = false;
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
