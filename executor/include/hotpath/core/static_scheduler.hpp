// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// rclcpp 26.0.0 StaticSingleThreadedExecutor (static_single_threaded_executor.cpp): after each
/// wait it runs all executables that the wait found ready. Subscriptions run first, then timers,
/// then services and clients, each kind in entity order; a timer must still be ready when its turn
/// comes. Callback groups are ignored.
class StaticScheduler final : public WaitSet {
 public:
  explicit StaticScheduler(const TaskSet& set, const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, 1, TaskKind::subscription, entity_order) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job&, Time) override { return {}; }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<StaticScheduler>(*this);
  }

 private:
  WorkerSet joined(TaskId) override { return WorkerSet::of(0); }
  std::optional<Job> next_ready(Time now);

  bool sleeps_ = false;  // whether the worker sleeps in rcl_wait
};

}  // namespace hotpath
