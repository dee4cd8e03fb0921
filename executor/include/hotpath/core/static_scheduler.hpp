// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// rclcpp 26.0.0 StaticSingleThreadedExecutor (static_single_threaded_executor.cpp): each wait is followed by
/// all executables that it found ready, subscriptions first, then timers, which must be ready again when
/// their turn comes; each in entity order. Callback groups are ignored.
class StaticScheduler final : public WaitSet {
 public:
  explicit StaticScheduler(const TaskSet& set, const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, 1, TaskKind::subscription, entity_order) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job&, Time) override { return {}; }
  [[nodiscard]] std::unique_ptr<Scheduler> clone() const override {
    return std::make_unique<StaticScheduler>(*this);
  }

 private:
  WorkerSet joined(TaskId) override { return WorkerSet::of(0); }
  std::optional<Job> next_ready(Time now);

  bool sleeps_ = false;  // in rcl_wait
};

}  // namespace hotpath
