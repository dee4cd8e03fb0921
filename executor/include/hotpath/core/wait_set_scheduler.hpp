// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

/// rclcpp's SingleThreadedExecutor (one worker) and MultiThreadedExecutor (several), rclcpp 26.0.0
/// executor.cpp and allocator_memory_strategy.hpp: at a polling point every ready timer and subscription is
/// entered once into a snapshot that all workers share; the processing window picks timers before
/// subscriptions, each in creation order, and `call()` happens at the pick. What becomes ready meanwhile
/// waits for the next poll. A mutually exclusive callback group with a running job is left out of polls and
/// picks.
class WaitSetScheduler final : public Scheduler {
 public:
  /// `workers` in [1, kMaxWorkers].
  WaitSetScheduler(const TaskSet& set, unsigned workers);

  std::span<const WorkerRole> workers() const override { return roles_; }
  void begin(Time epoch) override;
  Effect release_timers(Worker, Time) override { return {}; }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  std::uint32_t unread(TaskId task) const override { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override;

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

  bool group_free(TaskId task) const { return !group_busy_[set_.tasks[task].group]; }
  void occupy_group(TaskId task);
  void poll(Time now);
  std::optional<Job> pick(Time now);

  const TaskSet set_;
  const std::vector<WorkerRole> roles_;
  std::vector<TaskId> timer_ids_, subscription_ids_;  // creation order
  std::vector<Timer> timers_;                         // parallel to timer_ids_
  UnreadSamples unread_;
  ReadyList ready_timers_, ready_subscriptions_;  // the snapshot, as indices into the lists above
  Time polled_at_{};
  std::vector<bool> group_busy_;
  WorkerSet idle_;
  // Of the idle workers only one sleeps in rcl_wait; the others queue on its mutex
  // (multi_threaded_executor.cpp).
  std::optional<Worker> waiting_;
};

}  // namespace hotpath
