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

  void begin(Time epoch) override;
  Effect release_timers(Worker worker, Time now) override;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  Joined add_task(const JoiningTask& joining, Time now) override;
  void remove_task(TaskId task, Time now, const Visitor& dropped) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<CallbackGroupScheduler>(*this);
  }
  void describe(StateWords& words) const override;
  [[nodiscard]] std::span<const Timer> timers() const override { return timers_; }
  void release_at(TaskId timer, Time due) override;
  void released_by(Time now) override;

 private:
  struct Group {
    SimpleEventsQueue events{16};
    bool idle = true;  ///< An event makes it ready: it is not, and no job ended after the last event.
  };
  /// A timer in the timer manager, ordered by Timer::due(), then by order of insertion.
  struct Waiting {
    Time due;
    std::uint64_t order;
    std::uint32_t timer;
  };
  static bool later(const Waiting& a, const Waiting& b) {
    return a.due != b.due ? a.due > b.due : a.order > b.order;
  }
  /// Those that do not wait too, as if they began to.
  [[nodiscard]] std::vector<Waiting> all_in_order() const;

  [[nodiscard]] Worker timer_manager() const { return static_cast<Worker>(workers().size() - 1); }
  /// Inserts the timer into the timer manager; returns whether it has the earliest next call there.
  bool manage(std::uint32_t timer);
  /// Queues an event of `task`; returns the worker to wake, if any.
  WorkerSet add_event(TaskId task, Time now);
  WorkerSet queue_group(std::uint32_t group);
  /// The worker to wake for a ready group, if any.
  WorkerSet wake_one();
  [[nodiscard]] Job take(const Job& event, Time now);
  /// Removes the event that runs next from its group, and the group from the ready groups.
  [[nodiscard]] std::optional<Job> next_event();

  const Requeue requeue_;
  std::vector<Timer> timers_;
  std::vector<std::uint32_t> timer_index_;  // by task
  std::vector<Waiting> waiting_;            // a heap, the first that is due first
  std::uint64_t waited_ = 0;                // insertions into waiting_ so far
  bool any_delays_ = false;                 // of timers that may be ready later than at their timestamps
  std::vector<Group> groups_;
  std::vector<std::uint32_t> ready_groups_;  // in the order in which workers take them; each at most once
  WorkerSet idle_;                           // found nothing to run and have not been woken since
  std::optional<Worker> woken_;              // Requeue::at_dispatch: has not looked for a group yet
};

}  // namespace hotpath
