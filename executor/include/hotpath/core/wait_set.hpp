// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// What rclcpp's executors that poll a wait set have in common: the timers and subscriptions of this process
/// in creation order, and the snapshot of those that the last poll found ready.
class WaitSet : public Scheduler {
 public:
  [[nodiscard]] std::span<const WorkerRole> workers() const final { return roles_; }
  void begin(Time epoch) final;
  Effect release_timers(Worker, Time) final { return {}; }
  [[nodiscard]] std::uint32_t unread(TaskId task) const final { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const final {
    visit_unfinished(timers_, unread_, now, visit);
  }

 protected:
  WaitSet(const TaskSet& set, unsigned workers);

  /// Takes the snapshot anew, of those tasks of which `eligible(TaskId)` is true.
  template <class Eligible>
  void poll(Time now, Eligible&& eligible) {
    polled_at_ = now;
    ready_timers_.clear();
    ready_subscriptions_.clear();
    for (std::uint32_t i = 0; i < timer_ids_.size(); ++i) {
      if (timers_[i].is_ready(now) && eligible(timer_ids_[i])) ready_timers_.add(i);
    }
    for (std::uint32_t i = 0; i < subscription_ids_.size(); ++i) {
      const TaskId id = subscription_ids_[i];
      if (unread_.count(id) > 0 && eligible(id)) ready_subscriptions_.add(i);
    }
  }

  /// The job of the first eligible timer of the snapshot, which is called.
  template <class Eligible>
  std::optional<Job> call_timer(Time now, Eligible&& eligible) {
    const auto timer =
        ready_timers_.take_first([&](std::uint32_t i) { return eligible(timer_ids_[i], timers_[i]); });
    if (!timer) return std::nullopt;
    Job job = timers_[*timer].call(now);
    job.release = polled_at_;
    return job;
  }

  /// The job of the first eligible subscription of the snapshot, whose oldest sample is taken.
  template <class Eligible>
  std::optional<Job> take_sample(Eligible&& eligible) {
    const auto subscription =
        ready_subscriptions_.take_first([&](std::uint32_t i) { return eligible(subscription_ids_[i]); });
    if (!subscription) return std::nullopt;
    Job job = unread_.take(subscription_ids_[*subscription]);
    // A sample overwritten since the poll gave its place in the snapshot to a younger one.
    job.release = std::max(polled_at_, job.timestamp);
    return job;
  }

  /// When the first of the eligible timers falls due.
  template <class Eligible>
  [[nodiscard]] Time next_timer(Eligible&& eligible) const {
    Time next = kNever;
    for (std::uint32_t i = 0; i < timer_ids_.size(); ++i) {
      if (eligible(timer_ids_[i])) next = std::min(next, timers_[i].next_call());
    }
    return next;
  }

  const TaskSet set_;
  UnreadSamples unread_;

 private:
  /// What a poll found ready, in creation order. Mostly the front is taken.
  class ReadyList {
   public:
    void reserve(std::size_t n) { items_.reserve(n); }
    void clear() {
      items_.clear();
      next_ = 0;
    }
    void add(std::uint32_t item) { items_.push_back(item); }
    template <class Executable>
    std::optional<std::uint32_t> take_first(Executable&& executable) {
      for (std::size_t at = next_; at < items_.size(); ++at) {
        const std::uint32_t item = items_[at];
        if (!executable(item)) continue;
        if (at == next_) {
          ++next_;
        } else {
          items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(at));
        }
        return item;
      }
      return std::nullopt;
    }

   private:
    std::vector<std::uint32_t> items_;
    std::size_t next_ = 0;
  };

  const std::vector<WorkerRole> roles_;
  std::vector<TaskId> timer_ids_, subscription_ids_;  // creation order
  std::vector<Timer> timers_;                         // parallel to timer_ids_
  ReadyList ready_timers_, ready_subscriptions_;      // the snapshot, as indices into the lists above
  Time polled_at_{};
};

}  // namespace hotpath
