// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/timers_manager.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// What the events executors share: an events queue served by the executor worker, edge-triggered by arriving
/// samples, one event each. A subscription's event takes the oldest unread sample when it runs, or finds
/// none.
class EventsScheduler : public Scheduler {
 public:
  static constexpr Worker kExecutor = 0;
  static constexpr Worker kTimerManagement = 1;

  [[nodiscard]] std::span<const WorkerRole> workers() const final { return kRoles; }
  void begin(Time epoch) final;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) final;
  Effect finished(Worker, const Job&, Time) final { return {}; }
  [[nodiscard]] std::uint32_t unread(TaskId task) const final { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;
  Joined add_task(const JoiningTask& joining, Time now) final;
  void remove_task(TaskId task, Time now, const Visitor& dropped) final;

 protected:
  EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events);
  /// The executor worker's decision: the head of the events queue.
  Decision next_event();
  /// The events queue, and what a derived class has beside it.
  virtual void for_each_queue(const std::function<void(EventsQueue&)>& visit) { visit(*events_); }

  std::unique_ptr<EventsQueue> events_;
  TimersManager timers_;

 private:
  static constexpr std::array kRoles = {WorkerRole::executor, WorkerRole::timer_management};
  TaskSet set_;
  UnreadSamples unread_;
};

}  // namespace hotpath
