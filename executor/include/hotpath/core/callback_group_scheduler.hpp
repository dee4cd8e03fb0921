// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/simple_events_queue.hpp"
#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// EventsCBGExecutor (cm_executors: events_cbg_executor.cpp, FirstInFirstOutScheduler.cpp, timer_manager.hpp;
/// in rclcpp since Lyrical). Every callback group has a queue of ready events, and the groups that have some
/// and run nothing stand in a queue of their own. A worker takes the first group out of that queue and runs
/// its first event; afterwards the group, if it has more, queues up at the end. No two events of a group run
/// at once, not even of a reentrant one.
///
/// A timer that falls due is taken off the timer manager and put into its group's queue; it is called, by
/// rcl's rule for a late timer, when it starts, and goes back to the timer manager when it has run. A
/// subscription has one event for each sample that arrived; it takes the oldest that is left, or nothing.
class CallbackGroupScheduler final : public Scheduler {
 public:
  /// `workers` in [1, kMaxWorkers - 1] run events; one more manages the timers.
  CallbackGroupScheduler(const TaskSet& set, unsigned workers);

  [[nodiscard]] std::span<const WorkerRole> workers() const override { return roles_; }
  void begin(Time epoch) override;
  Effect release_timers(Worker worker, Time now) override;
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::uint32_t unread(TaskId task) const override { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override {
    visit_unfinished(timers_, unread_, now, visit);
  }
  Joined add_task(const JoiningTask& joining, Time now) override;
  void remove_task(TaskId task, Time now, const Visitor& dropped) override;
  [[nodiscard]] std::unique_ptr<Scheduler> clone() const override {
    return roles_.size() == 2 ? std::make_unique<CallbackGroupScheduler>(*this) : nullptr;
  }
  void describe(StateWords& words) const override;
  [[nodiscard]] Time next_change(Time now) const override { return next_timestamp(timers_, now); }

 private:
  struct Group {
    SimpleEventsQueue events{16};
    bool idle = true;  ///< Neither in the queue of ready groups nor running.
  };
  /// A timer in the timer manager: by next call, then by when it came.
  struct Waiting {
    Time next_call;
    std::uint64_t order;
    std::uint32_t timer;
  };
  static bool later(const Waiting& a, const Waiting& b) {
    return a.next_call != b.next_call ? a.next_call > b.next_call : a.order > b.order;
  }
  /// A queue in which every group stands once at most.
  class GroupQueue {
   public:
    explicit GroupQueue(std::size_t groups) : ring_(groups) {}
    [[nodiscard]] bool empty() const { return count_ == 0; }
    void push(std::uint32_t group) { ring_[(head_ + count_++) % ring_.size()] = group; }
    std::uint32_t pop() {
      const std::uint32_t group = ring_[head_];
      head_ = (head_ + 1) % ring_.size();
      --count_;
      return group;
    }
    void resize(std::size_t groups) {
      std::rotate(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(head_), ring_.end());
      head_ = 0;
      ring_.resize(groups);
    }
    void describe(StateWords& words) const {
      words.add(static_cast<std::int64_t>(count_));
      for (std::size_t i = 0; i < count_; ++i) words.add(ring_[(head_ + i) % ring_.size()]);
    }
    /// Returns whether it was there.
    bool erase(std::uint32_t group) {
      bool found = false;
      for (std::size_t left = count_; left > 0; --left) {
        const std::uint32_t first = pop();
        first == group ? static_cast<void>(found = true) : push(first);
      }
      return found;
    }

   private:
    std::vector<std::uint32_t> ring_;
    std::size_t head_ = 0, count_ = 0;
  };

  [[nodiscard]] Worker timer_manager() const { return static_cast<Worker>(roles_.size() - 1); }
  /// Takes the timer into the timer manager; returns whether it is the first there.
  bool manage(std::uint32_t timer);
  /// Queues an event of `task`; the returned worker, if any, must be woken for it.
  WorkerSet add_event(TaskId task, Time now);
  WorkerSet queue_group(std::uint32_t group);
  [[nodiscard]] Job take(const Job& event, Time now);

  TaskSet set_;
  const std::vector<WorkerRole> roles_;
  UnreadSamples unread_;
  std::vector<Timer> timers_;
  std::vector<std::uint32_t> timer_index_;  // by task
  std::vector<Waiting> waiting_;            // a heap, the next call first
  std::uint64_t waited_ = 0;                // timers ever put into it
  std::vector<Group> groups_;
  GroupQueue ready_groups_;
  WorkerSet idle_;  // nobody has woken them since they found nothing to run
};

}  // namespace hotpath
