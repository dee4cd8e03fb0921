// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// rclcpp 26.0.0 StaticSingleThreadedExecutor (static_single_threaded_executor.cpp): each wait is followed by
/// all executables that it found ready, subscriptions first, then timers, which must be ready again when
/// their turn comes; each in creation order. Callback groups are ignored.
class StaticScheduler final : public Scheduler {
 public:
  explicit StaticScheduler(const TaskSet& set);

  std::span<const WorkerRole> workers() const override { return roles_; }
  void begin(Time epoch) override;
  Effect release_timers(Worker, Time) override { return {}; }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job&, Time) override { return {}; }
  std::uint32_t unread(TaskId task) const override { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;

 private:
  void wait(Time now);
  std::optional<Job> next_ready(Time now);

  const TaskSet set_;
  const std::vector<WorkerRole> roles_ = {WorkerRole::executor};
  std::vector<TaskId> timer_ids_, subscription_ids_;
  std::vector<Timer> timers_;
  UnreadSamples unread_;
  std::vector<std::uint32_t> ready_subscriptions_, ready_timers_;
  std::size_t next_subscription_ = 0, next_timer_ = 0;  // how far the pass has come
  Time waited_at_{};
};

}  // namespace hotpath
