// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/explored_scheduler.hpp"
#include "hotpath/core/timers_manager.hpp"

namespace hotpath {

/// When a reentrant group with further events joins the queue of ready groups again.
enum class Requeue : std::uint8_t {
  at_end,       ///< When its job ends, like any group: cm_executors, and rclcpp before PR 3178.
  at_dispatch,  ///< When its job is dispatched, so that others run beside it: rclcpp from PR 3178 (2026) on.
};

/// EventsCBGExecutor (cm_executors: events_cbg_executor.cpp, FirstInFirstOutScheduler.cpp,
/// timer_manager.hpp; in rclcpp since Lyrical). Every callback group has a queue of ready events.
/// Groups that have events and run no job wait in a queue of groups. A worker takes the first group
/// from that queue and runs the group's first event; a group with more events then joins the end of
/// the queue. With Requeue::at_end two events of a group never run at once, even if it is reentrant. With
/// Requeue::at_dispatch they may, but not fully: an event that arrives while a job of the group runs and no
/// other event waits makes the group ready only at the end of one of its jobs.
///
/// One wake-up is pending at a time: the woken worker takes a group, then wakes another if there are more.
///
/// A due timer moves from the timer manager into its group's queue. It is called, by rcl's rule for
/// a late timer, when its job starts, and returns to the timer manager when the job has finished. A
/// subscription has one event per arrived sample; the event takes the oldest unread sample, or
/// nothing.
class CallbackGroupScheduler final : public ExploredScheduler {
 public:
  /// `workers` in [1, kMaxWorkers - 1] run events; one more manages the timers.
  CallbackGroupScheduler(const TaskSet& set, unsigned workers, Requeue requeue = Requeue::at_end);

  void begin(Time epoch) override { timers_.begin(set_, epoch); }
  Effect release_timers(Worker worker, Time now) override;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override {
    Arrival arrival;
    arrival.overwritten = add_unread(task, sample);
    arrival.wake = add_event(task, now);
    return arrival;
  }
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  Joined add_task(const JoiningTask& joining, Time now) override;
  void remove_task(TaskId task, Time now, const Visitor& dropped) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<CallbackGroupScheduler>(*this);
  }
  void describe(StateWords& words) const override;
  [[nodiscard]] std::span<const Timer> timers() const override { return timers_.timers(); }
  void release_at(TaskId timer, Time due) override { timers_.release_at(timer, due); }
  void released_by(Time now) override { timers_.released_by(now); }

 private:
  struct Group {
    SimpleEventsQueue events{16};
    bool idle = true;  ///< An event makes it ready: it is not, and no job ended after the last event.
  };

  [[nodiscard]] Worker timer_manager() const { return static_cast<Worker>(workers().size() - 1); }
  /// Queues an event of `task`; returns the worker to wake, if any.
  WorkerSet add_event(TaskId task, Time now);
  WorkerSet queue_group(std::uint32_t group) {
    ready_groups_.push_back(group);
    return wake_one();
  }
  /// The worker to wake for a ready group, if any.
  WorkerSet wake_one() {
    if (idle_.empty() || woken_) return {};
    const Worker worker = idle_.pop_first();
    if (requeue_ == Requeue::at_dispatch) woken_ = worker;
    return WorkerSet::of(worker);
  }
  [[nodiscard]] Job take(const Job& event, Time now);
  /// Removes the event that runs next from its group, and the group from the ready groups.
  [[nodiscard]] std::optional<Job> next_event();

  const Requeue requeue_;
  TimersManager timers_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> ready_groups_;  // in the order in which workers take them; each at most once
  WorkerSet idle_;                           // found nothing to run and have not been woken since
  std::optional<Worker> woken_;              // Requeue::at_dispatch: has not looked for a group yet
};

}  // namespace hotpath
