// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// rclcpp's SingleThreadedExecutor (one worker) and MultiThreadedExecutor (several), rclcpp 26.0.0
/// executor.cpp and allocator_memory_strategy.hpp: at a polling point every ready timer and subscription is
/// entered once into a snapshot that all workers share; the processing window picks timers before
/// subscriptions, each in creation order, and `call()` happens at the pick. What becomes ready meanwhile
/// waits for the next poll. A mutually exclusive callback group with a running job is left out of polls and
/// picks.
class WaitSetScheduler final : public Scheduler {
 public:
  /// `workers` in [1, kMaxWorkers].
  WaitSetScheduler(const TaskSet& set, unsigned workers);

  std::span<const WorkerRole> workers() const override { return roles_; }
  void begin(Time epoch) override;
  Effect release_timers(Worker, Time) override { return {}; }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  std::uint32_t unread(TaskId task) const override { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;

 private:
  bool group_free(TaskId task) const { return !group_busy_[set_.tasks[task].group]; }
  void occupy_group(TaskId task);
  void poll(Time now);
  std::optional<Job> pick(Time now);

  const TaskSet set_;
  const std::vector<WorkerRole> roles_;
  std::vector<TaskId> timer_ids_, subscription_ids_;  // creation order
  std::vector<Timer> timers_;                         // parallel to timer_ids_
  UnreadSamples unread_;
  std::vector<std::uint32_t> ready_timers_,
      ready_subscriptions_;  // the snapshot, as indices into the lists above
  Time polled_at_{};
  std::vector<bool> group_busy_;
  WorkerSet idle_;
  // Of the idle workers only one sleeps in rcl_wait; the others queue on its mutex
  // (multi_threaded_executor.cpp).
  std::optional<Worker> waiting_;
};

}  // namespace hotpath
