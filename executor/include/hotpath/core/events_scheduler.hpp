// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/explored_scheduler.hpp"
#include "hotpath/core/service_jobs.hpp"
#include "hotpath/core/timers_manager.hpp"

namespace hotpath {

/// The common part of the events executors: an events queue served by the executor workers,
/// edge-triggered with one event per arriving sample. A subscription's event takes the oldest
/// unread sample when it runs, or finds none. A single executor worker (rclcpp's, the paper's)
/// takes the head of the queue. With several, each takes the first event whose callback group is
/// reentrant or has no running job.
class EventsScheduler : public ExploredScheduler {
 public:
  static constexpr Worker kExecutor = 0;
  static constexpr Worker kTimerManagement = 1;  ///< With one executor worker; see timer_management().

  void begin(Time epoch) final { timers_.begin(set_, epoch); }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) final;
  Effect finished(Worker worker, const Job& job, Time now) final;
  void unfinished(Time now, const Visitor& visit) const override;
  Joined add_task(const JoiningTask& joining, Time now) final;
  void remove_task(TaskId task, Time now, const Visitor& dropped) final;
  void change_task(TaskId task, const std::optional<std::int64_t>& priority,
                   const std::vector<TaskId>& feeds) final;
  void describe(StateWords& words) const override;
  [[nodiscard]] Time next_change(Time now) const final {
    return std::min(ExploredScheduler::next_change(now), services_.next_change(now));
  }
  [[nodiscard]] std::span<const Timer> timers() const final { return timers_.timers(); }
  void release_at(TaskId timer, Time due) final { timers_.release_at(timer, due); }
  void released_by(Time now) final { timers_.released_by(now); }
  [[nodiscard]] bool hands_deadlines_down() const final { return events_->by_deadline(); }
  /// See SchedulerOptions::service_wait. Call it before begin().
  void limit_service_wait(Duration wait) { services_ = ServiceJobs(wait); }

 protected:
  /// `executors` in [1, kMaxWorkers - 1].
  EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, unsigned executors = 1);
  [[nodiscard]] Worker timer_management() const { return static_cast<Worker>(workers().size() - 1); }
  [[nodiscard]] WorkerSet executors() const {
    WorkerSet all;
    for (Worker w = 0; w < timer_management(); ++w) all.insert(w);
    return all;
  }
  /// An executor worker's decision.
  Decision decide_events(Time now);
  /// Turns due timers, all or the first, into events of a queue.
  Effect release_due(EventsQueue& queue, bool all, Time now);
  /// Takes the first job that may run from a queue, which is not empty; nullptr if there is none.
  [[nodiscard]] const Job* next_of(EventsQueue& queue) const;
  /// Visits the events queue and any further queue of a derived class.
  virtual void for_each_queue(const std::function<void(EventsQueue&)>& visit) { visit(*events_); }

  Cloned<EventsQueue> events_;
  TimersManager timers_;

 private:
  /// Whether no running job keeps the task's callback group busy.
  [[nodiscard]] bool is_free(TaskId task) const {
    return timer_management() == 1 || !busy_[set_[task].group];
  }
  [[nodiscard]] const Job* next_event(Time now);

  ServiceJobs services_;
  std::vector<bool> busy_;  // by callback group; used with several executor workers
};

/// Release-only (RO): the timer management worker turns due timers into events; the executor workers run all
/// jobs.
class ReleaseOnlyScheduler final : public EventsScheduler {
 public:
  /// one_by_one: one timer and one wake-up per call (stock, timers_manager.cpp); all_due: all due
  /// timers under one lock with one wake-up (the paper's).
  enum class Release : std::uint8_t { one_by_one, all_due };
  ReleaseOnlyScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, Release release,
                       unsigned executors = 1)
      : EventsScheduler(set, std::move(events), executors), release_(release) {}

  Effect release_timers(Worker worker, Time now) override;
  Decision decide(Worker worker, Time now) override {
    if (worker != timer_management()) return decide_events(now);
    return {std::nullopt, timers_.next_due(), {}};
  }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return timer_management() == 1 ? std::make_unique<ReleaseOnlyScheduler>(*this) : nullptr;
  }

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
  Decision decide(Worker worker, Time now) override {
    if (worker == kExecutor) return decide_events(now);
    if (!timers_.due(now)) return {std::nullopt, timers_.next_due(), {}};
    if (!follows()) return {timers_.call_head(now), kNever, {}};
    const auto job = timers_.call_first(now, [this](TaskId timer) { return may_run(timer); });
    return {job, job ? kNever : timers_.next_due(), {}};
  }
};

/// The paper's release-and-execute (Section IV): due timers move into a prioritised timer ready
/// queue, which is refilled before every decision; its head runs. The executor worker runs
/// subscriptions.
class TimerReadyQueueScheduler final : public EventsScheduler {
 public:
  TimerReadyQueueScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events,
                           std::unique_ptr<EventsQueue> timer_ready)
      : EventsScheduler(set, std::move(events)), timer_ready_(std::move(timer_ready)) {}

  Effect release_timers(Worker worker, Time now) override {
    return worker == kTimerManagement ? release_due(*timer_ready_, true, now) : Effect{};
  }
  Decision decide(Worker worker, Time now) override {
    if (worker == kExecutor) return decide_events(now);
    const Job* const job = timer_ready_->empty() ? nullptr : next_of(*timer_ready_);
    if (job == nullptr) return {std::nullopt, timers_.next_due(), {}};
    return {*job, kNever, {}};
  }
  void unfinished(Time now, const Visitor& visit) const override {
    timer_ready_->for_each([&](const Job& job) { visit(job, Outcome::queued); });
    EventsScheduler::unfinished(now, visit);
  }

 private:
  void for_each_queue(const std::function<void(EventsQueue&)>& visit) override {
    EventsScheduler::for_each_queue(visit);
    visit(*timer_ready_);
  }

  std::unique_ptr<EventsQueue> timer_ready_;
};

}  // namespace hotpath
