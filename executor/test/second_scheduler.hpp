// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <tuple>

#include "schedule_checks.hpp"

namespace hotpath::test {

/// An independent implementation of the schedule of the paper's release-only executors, on one core
/// without costs: one list of released jobs, searched completely before every job. It shares only
/// the clock types with the library.
class SecondScheduler {
 public:
  SecondScheduler(const TaskSet& set, const std::string& policy, bool subscriptions_first, bool fifo_ties)
      : set_(set),
        priority_(set, policy),
        first_(subscriptions_first),
        fifo_(fifo_ties),
        timestamps_(set.size(), 0),
        unread_(set.size()),
        samples_(set.size(), 0) {}

  std::vector<Ran> run(Duration end) {
    std::vector<Ran> schedule;
    Duration now{};
    while (now < end) {
      release_timers_up_to(now);
      if (released_.empty()) {
        now = next_timestamp();
        continue;
      }
      auto best = released_.begin();
      for (auto it = best; it != released_.end(); ++it) {
        if (order(*it) < order(*best)) best = it;
      }
      Job job = best->job;
      released_.erase(best);
      if (set_[job.task].kind == TaskKind::subscription) {
        if (unread_[job.task].empty()) continue;
        job = unread_[job.task].front();
        unread_[job.task].pop_front();
      }
      const Duration start = now;
      now += set_[job.task].wcet;
      if (set_[job.task].wcet > 0ns) release_timers_up_to(now - 1ns);
      if (now >= end) break;
      schedule.push_back({job.task, job.sequence, start, now});
      for (const TaskId fed : set_[job.task].feeds) {
        const Job sample{.task = fed, .sequence = samples_[fed]++, .deadline = job.deadline};
        unread_[fed].push_back(sample);
        if (unread_[fed].size() > set_[fed].depth) unread_[fed].pop_front();
        released_.push_back({sample, activations_++});
      }
    }
    return schedule;
  }

 private:
  struct Released {
    Job job;
    std::int64_t activation;
  };

  // Smaller runs first: priority; then subscriptions, youngest first; then timers by id and
  // timestamp.
  std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int64_t, std::uint64_t> order(
      const Released& r) const {
    const bool timer = set_[r.job.task].kind == TaskKind::timer;
    const std::int64_t priority =
        !timer && first_ ? std::numeric_limits<std::int64_t>::min() : priority_.of(r.job);
    if (fifo_) return {priority, r.activation, 0, 0, 0};
    if (!timer) return {priority, 0, -r.activation, 0, 0};
    return {priority, 1, 0, r.job.task, r.job.sequence};
  }

  Duration timestamp(TaskId id) const {
    return set_[id].phase + static_cast<std::int64_t>(timestamps_[id]) * set_[id].period;
  }

  Duration next_timestamp() const {
    Duration next = Duration::max();
    for (TaskId id = 0; id < set_.size(); ++id) {
      if (set_[id].kind == TaskKind::timer) next = std::min(next, timestamp(id));
    }
    return next;
  }

  void release_timers_up_to(Duration now) {
    while (next_timestamp() <= now) {
      const Duration next = next_timestamp();
      for (TaskId id = 0; id < set_.size(); ++id) {
        if (set_[id].kind != TaskKind::timer || timestamp(id) != next) continue;
        const Time deadline = at(next + set_[id].deadline);
        released_.push_back(
            {{.task = id, .sequence = timestamps_[id]++, .deadline = deadline}, activations_++});
      }
    }
  }

  const TaskSet& set_;
  const PriorityByTheBook priority_;
  const bool first_, fifo_;
  std::vector<std::uint64_t> timestamps_;  // released, by timer
  std::vector<std::deque<Job>> unread_;    // per subscription
  std::vector<std::uint64_t> samples_;     // arrived, by subscription
  std::vector<Released> released_;
  std::int64_t activations_ = 0;
};

}  // namespace hotpath::test
