// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath::results {

/// One job that ran or was running, recorded by hotpath or by the ROS 2 stack.
struct ExecutedJob : JobRecord {
  Time next_call = kNever;  ///< Timers: the timer's next call as read at the start of the job.
};

/// The executed jobs of one run, by start; times count from its epoch.
struct Schedule {
  TaskSet set;
  std::vector<ExecutedJob> jobs;
};

/// When the timers of one run were to be called next, as read at any instant: one period after the
/// latest timestamp released, or skipped, by then. Needs 16 bytes per job.
class NextCalls {
 public:
  explicit NextCalls(const TaskSet& set) : set_(set), released_(set.size()) {}

  void add(const JobRecord& r) {
    const Task& task = set_[r.job.task];
    if (task.kind != TaskKind::timer || (!r.started() && r.outcome != Outcome::queued)) return;
    released_[r.job.task].push_back({r.job.release, r.job.timestamp + (1 + r.job.skipped) * task.period});
  }
  /// Ends the adding of jobs.
  void sort() {
    for (auto& of_timer : released_) std::ranges::stable_sort(of_timer, {}, &Release::release);
  }
  /// kNever before the timer's first release.
  [[nodiscard]] Time at(TaskId timer, Time instant) const {
    const auto later = std::ranges::upper_bound(released_[timer], instant, {}, &Release::release);
    return later == released_[timer].begin() ? kNever : std::prev(later)->next_call;
  }

 private:
  struct Release {
    Time release, next_call;
  };
  const TaskSet& set_;
  std::vector<std::vector<Release>> released_;  // by timer
};

/// The jobs of a trace that ran or were running, with their timers' NextCalls.
[[nodiscard]] Schedule schedule_of(const TaskSet& set, const Trace& trace);

/// The jobs of a golden trace, which has no timestamps; they follow from the next calls. A job
/// started by the timer's own call (wait sets, release-and-execute) has the next call at the
/// previous job as its timestamp; a job started by a releaser (`release_only`) has the timestamp of
/// its number.
[[nodiscard]] Schedule schedule_of(const GoldenTrace& trace, bool release_only);

/// The authors' response time (their sensor.hpp): finish - (next call at the start - period). Under
/// a release-only executor with backlog that refers to a later release than the job's own.
[[nodiscard]] inline Duration response_authors(const Task& timer, Time next_call, Time finish) {
  return finish - (next_call - timer.period);
}
[[nodiscard]] inline Duration response_authors(const Schedule& schedule, const ExecutedJob& job) {
  return response_authors(schedule.set[job.job.task], job.next_call, job.finish);
}

/// Two subscriptions of one topic whose samples arrived in another order than the graph's.
struct SwappedArrivals {
  TaskId stated_first = kNoTask, arrived_first = kNoTask;
  std::uint64_t messages = 0;  ///< Read by both.
  std::uint64_t swapped = 0;   ///< Of these, those that reached `arrived_first` first.
};

/// Compares the arrivals (Job::release) of each message at neighbours in the order of delivery. Of an
/// executor that polls, only arrivals before different polls can be told apart.
[[nodiscard]] std::vector<SwappedArrivals> swapped_arrivals(const GraphTasks& tasks, const Trace& trace);

}  // namespace hotpath::results
