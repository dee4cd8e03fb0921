// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/wait_mutex.hpp"
#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// rclcpp's MultiThreadedExecutor from 28 on (Jazzy; executor.cpp, wait_result.hpp,
/// executor_entities_collection.cpp, multi_threaded_executor.cpp). The wait set outlives the wait. The end of
/// a job of a mutually exclusive group triggers a guard condition; the wait that it ends has the wait set
/// rebuilt before the next one: groups that are busy then leave it, groups that have become free are appended
/// to it, so that the order in it changes all the time. That is why nobody starves here who starves under
/// rclcpp 26.
///
/// Between two rebuilds the wait set has tasks whose group is busy. Of the snapshot, a blocked timer stays in
/// it and a blocked subscription is gone until the next poll. A worker that finds blocked tasks alone polls
/// again at once, and again, until something changes; here it sleeps until then.
class RebuiltWaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]. What is appended to the wait set together comes in reverse order of
  /// creation: the hash maps from which rclcpp takes it begin with what was inserted last.
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

  std::vector<TaskId> waited_timers_, waited_subscriptions_;  // the wait set, in its order
  std::vector<bool> is_waited_for_;                           // by task
  bool interrupted_ = false;                                  // the guard condition is triggered
  bool needs_rebuild_ = false;
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
