// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/core/explored_scheduler.hpp"

namespace hotpath {

/// The common part of rclcpp's executors that poll a wait set: the timers and subscriptions of this
/// process in entity order, and the snapshot: the tasks that the last poll found ready and that
/// have not run since, in execution order.
class WaitSet : public ExploredScheduler {
 public:
  void begin(Time epoch) final;
  Effect release_timers(Worker, Time) final { return {}; }
  Joined add_task(const JoiningTask& joining, Time now) final;
  void remove_task(TaskId task, Time now, const Visitor& dropped) final;
  void describe(StateWords& words) const override;
  [[nodiscard]] std::span<const Timer> timers() const final { return timers_; }
  void release_at(TaskId id, Time due) final { timer(id).release_at(due); }
  void released_by(Time now) final {
    for (Timer& timer : timers_) timer.released_by(now);
  }

 protected:
  /// The task has been appended to the entity order. Returns the workers to wake.
  virtual WorkerSet joined(TaskId task) = 0;
  /// The task has been removed from the entity order.
  virtual void left(TaskId task) { static_cast<void>(task); }

  /// What to do with a task of the snapshot when a worker looks for its next job.
  enum class Pick : std::uint8_t {
    run,
    leave,   ///< Continue with the next task; this one stays in the snapshot.
    forget,  ///< Continue with the next task; this one waits for the next poll.
  };

  /// A snapshot is in_order_of_kinds().
  WaitSet(const TaskSet& set, unsigned workers, TaskKind runs_first, const std::vector<TaskId>& entity_order);

  /// Appends the ready tasks for which `eligible(TaskId)` is true to the snapshot. Returns the
  /// number of tasks in the wait set.
  template <class Eligible>
  std::uint32_t poll(Time now, Eligible&& eligible) {
    const auto poll_samples = [&](auto from, auto to) {
      for (; from != to; ++from) {
        if (unread_.count(*from) > 0 && eligible(*from)) snapshot_.add(*from, now);
      }
    };
    const auto behind_timers =
        runs_first_ == TaskKind::timer ? subscription_ids_.begin() : first_behind_timers();
    poll_samples(subscription_ids_.begin(), behind_timers);
    poll_timers(now, eligible);
    poll_samples(behind_timers, subscription_ids_.end());
    return static_cast<std::uint32_t>(timer_ids_.size() + subscription_ids_.size());
  }

  /// Adds only `task`, if it is ready.
  void poll_task(TaskId task, Time now) {
    if (is_ready(task, now)) snapshot_.add(task, now);
  }

  void forget_snapshot() { snapshot_.clear(); }

  /// The job of the first task in the snapshot for which `pick(TaskId)` returns `run`: the timer is
  /// called or the subscription's oldest sample is taken. A mutually exclusive group is then busy
  /// until free_group().
  template <class Decide>
  std::optional<Job> take(Time now, Decide&& pick) {
    const TaskId id = snapshot_.take_first([&](TaskId task) {
      const Pick action = pick(task);
      return action == Pick::run && !may_run(task) ? Pick::leave : action;
    });
    if (id == kNoTask) return std::nullopt;
    Job job = set_.tasks[id].kind == TaskKind::timer ? timer(id).call(now) : unread_.pop(id);
    // If a sample was overwritten since the poll, a younger sample has its place in the snapshot.
    job.release = std::max(snapshot_.added_at(id), job.timestamp);
    group_busy_[group(id)] = set_.groups[group(id)] == CallbackGroup::mutually_exclusive;
    return job;
  }

  [[nodiscard]] bool group_free(TaskId task) const { return !group_busy_[group(task)]; }
  void free_group(TaskId task) { group_busy_[group(task)] = false; }
  /// By callback group.
  [[nodiscard]] const std::vector<bool>& busy_groups() const { return group_busy_; }

  /// When the first of the eligible timers is due.
  template <class Eligible>
  [[nodiscard]] Time next_timer(Eligible&& eligible) const {
    Time next = kNever;
    for (std::size_t i = 0; i < timers_.size(); ++i) {
      if (eligible(timer_ids_[i])) next = std::min(next, timers_[i].due());
    }
    return next;
  }

  [[nodiscard]] Timer& timer(TaskId id) { return timers_[timer_index_[id]]; }
  [[nodiscard]] bool is_ready(TaskId id, Time now) {
    return set_.tasks[id].kind == TaskKind::timer ? timer(id).is_ready(now) : unread_.count(id) > 0;
  }
  [[nodiscard]] const std::vector<TaskId>& timer_ids() const { return timer_ids_; }
  [[nodiscard]] const std::vector<TaskId>& subscription_ids() const { return subscription_ids_; }

 private:
  /// A list optimised for removal at the front.
  class Snapshot {
   public:
    explicit Snapshot(TaskId tasks) : contains_(tasks, false), added_at_(tasks) {}
    void reserve(std::size_t n) { tasks_.reserve(n); }
    void add_task() {
      contains_.push_back(false);
      added_at_.emplace_back();
    }
    void erase(TaskId task) {
      if (contains_[task])
        remove(static_cast<std::size_t>(
            std::find(tasks_.begin() + static_cast<std::ptrdiff_t>(next_), tasks_.end(), task) -
            tasks_.begin()));
    }
    void clear() {
      for (std::size_t at = next_; at < tasks_.size(); ++at) contains_[tasks_[at]] = false;
      tasks_.clear();
      next_ = 0;
    }
    void add(TaskId task, Time now) {
      if (contains_[task]) return;
      contains_[task] = true;
      added_at_[task] = now;
      if (tasks_.size() == tasks_.capacity()) {
        tasks_.erase(tasks_.begin(), tasks_.begin() + static_cast<std::ptrdiff_t>(next_));
        next_ = 0;
      }
      tasks_.push_back(task);
    }
    [[nodiscard]] std::span<const TaskId> tasks() const { return std::span(tasks_).subspan(next_); }
    /// When the task was last added.
    [[nodiscard]] Time added_at(TaskId task) const { return added_at_[task]; }
    template <class Decide>
    TaskId take_first(Decide&& pick) {
      for (std::size_t at = next_; at < tasks_.size();) {
        const TaskId task = tasks_[at];
        const Pick action = pick(task);
        if (action == Pick::leave) {
          ++at;
          continue;
        }
        remove(at);
        at = std::max(at, next_);
        if (action == Pick::run) return task;
      }
      return kNoTask;
    }

   private:
    void remove(std::size_t at) {
      contains_[tasks_[at]] = false;
      if (at == next_) {
        ++next_;
      } else {
        tasks_.erase(tasks_.begin() + static_cast<std::ptrdiff_t>(at));
      }
    }

    std::vector<TaskId> tasks_;
    std::size_t next_ = 0;
    std::vector<std::uint8_t> contains_;  // by task
    std::vector<Time> added_at_;          // by task
  };

  [[nodiscard]] std::uint32_t group(TaskId task) const { return set_.tasks[task].group; }
  /// If subscriptions run before timers: the first of another kind.
  [[nodiscard]] std::vector<TaskId>::const_iterator first_behind_timers() const {
    return std::ranges::partition_point(
        subscription_ids_, [this](TaskId id) { return set_[id].entity == EntityKind::subscription; });
  }

  template <class Eligible>
  void poll_timers(Time now, Eligible&& eligible) {
    for (std::size_t i = 0; i < timers_.size(); ++i) {
      if (timers_[i].is_ready(now) && eligible(timer_ids_[i])) snapshot_.add(timer_ids_[i], now);
    }
  }

  const TaskKind runs_first_;
  std::vector<TaskId> timer_ids_, subscription_ids_;  // in the order of kinds
  std::vector<Timer> timers_;                         // parallel to timer_ids_
  std::vector<std::uint32_t> timer_index_;            // by task
  Snapshot snapshot_;
  std::vector<bool> group_busy_;
};

}  // namespace hotpath
