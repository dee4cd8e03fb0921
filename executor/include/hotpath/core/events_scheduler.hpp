// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/explored_scheduler.hpp"
#include "hotpath/core/guaranteed_jobs.hpp"
#include "hotpath/core/timers_manager.hpp"
#include "hotpath/core/unread_samples.hpp"

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

  [[nodiscard]] std::span<const WorkerRole> workers() const final { return roles_; }
  void begin(Time epoch) final;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) final;
  Effect finished(Worker worker, const Job& job, Time now) final;
  [[nodiscard]] std::uint32_t unread(TaskId task) const final { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;
  Joined add_task(const JoiningTask& joining, Time now) final;
  void remove_task(TaskId task, Time now, const Visitor& dropped) final;
  void change_task(TaskId task, const std::optional<std::int64_t>& priority,
                   const std::vector<TaskId>& feeds) final;
  void describe(StateWords& words) const override;
  [[nodiscard]] Time next_change(Time now) const final {
    return std::min(next_timestamp(timers_.timers(), now), guaranteed_.next_change(now));
  }
  [[nodiscard]] std::span<const Timer> timers() const final { return timers_.timers(); }
  void release_at(TaskId timer, Time due) final { timers_.release_at(timer, due); }
  void released_by(Time now) final { timers_.released_by(now); }
  [[nodiscard]] bool hands_deadlines_down() const final { return events_->by_deadline(); }
  /// See SchedulerOptions::guaranteed_wait. Call it before begin().
  void guarantee(Duration wait) { guaranteed_ = GuaranteedJobs(wait); }

 protected:
  /// `executors` in [1, kMaxWorkers - 1].
  EventsScheduler(const TaskSet& set, std::unique_ptr<EventsQueue> events, unsigned executors = 1);
  EventsScheduler(const EventsScheduler& other);
  [[nodiscard]] Worker timer_management() const { return static_cast<Worker>(roles_.size() - 1); }
  [[nodiscard]] WorkerSet executors() const;
  /// An executor worker's decision.
  Decision next_event(Time now);
  /// Takes the first job that may run from a queue.
  [[nodiscard]] std::optional<Job> next_of(EventsQueue& queue) const;
  /// Visits the events queue and any further queue of a derived class.
  virtual void for_each_queue(const std::function<void(EventsQueue&)>& visit) { visit(*events_); }

  std::unique_ptr<EventsQueue> events_;
  TimersManager timers_;

 private:
  /// Whether no running job keeps the task's callback group busy.
  [[nodiscard]] bool is_free(TaskId task) const {
    return timer_management() == 1 || !busy_[set_[task].group];
  }
  [[nodiscard]] std::optional<Job> next_job(Time now);

  std::vector<WorkerRole> roles_;
  TaskSet set_;
  UnreadSamples unread_;
  GuaranteedJobs guaranteed_;
  std::vector<bool> busy_;  // by callback group; used with several executor workers
};

}  // namespace hotpath
