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

  std::span<const WorkerRole> workers() const final { return kRoles; }
  void begin(Time epoch) final;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) final;
  Effect finished(Worker, const Job&, Time) final { return {}; }
  std::uint32_t unread(TaskId task) const final { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;

 protected:
  EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events);
  /// The executor worker's decision: the head of the events queue.
  Decision next_event();

  std::unique_ptr<EventsQueue> events_;
  TimersManager timers_;

 private:
  static constexpr std::array kRoles = {WorkerRole::executor, WorkerRole::timer_management};
  const TaskSet set_;
  UnreadSamples unread_;
};

/// Release-only (RO): the timer management worker turns due timers into events; the executor worker runs all
/// jobs.
class ReleaseOnlyScheduler final : public EventsScheduler {
 public:
  /// one_by_one: one timer per call and one wake-up each (stock, timers_manager.cpp); all_due: all timers
  /// that are due under one lock with one wake-up (the paper's).
  enum class Release : std::uint8_t { one_by_one, all_due };
  ReleaseOnlyScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, Release release)
      : EventsScheduler(set, std::move(events)), release_(release) {}

  Effect release_timers(Worker worker, Time now) override;
  Decision decide(Worker worker, Time now) override;

 private:
  const Release release_;
};

/// Stock release-and-execute (RE): the timer management worker calls and runs the timer with the earliest
/// next call (timers_manager.cpp); the executor worker runs subscriptions.
class ReleaseAndExecuteScheduler final : public EventsScheduler {
 public:
  ReleaseAndExecuteScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events)
      : EventsScheduler(set, std::move(events)) {}

  Effect release_timers(Worker, Time) override { return {}; }
  Decision decide(Worker worker, Time now) override;
};

/// The paper's release-and-execute (Section IV): due timers move into a prioritised timer ready queue, which
/// is filled again before every decision; its head runs. The executor worker runs subscriptions.
class TimerReadyQueueScheduler final : public EventsScheduler {
 public:
  TimerReadyQueueScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events,
                           std::unique_ptr<EventsQueue> timer_ready)
      : EventsScheduler(set, std::move(events)), timer_ready_(std::move(timer_ready)) {}

  Effect release_timers(Worker worker, Time now) override;
  Decision decide(Worker worker, Time now) override;
  void unfinished(Time now, const Visitor& visit) const override;

 private:
  std::unique_ptr<EventsQueue> timer_ready_;
};

}  // namespace hotpath
