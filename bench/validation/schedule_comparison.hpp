// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/trace.hpp"
#include "results/statistics.hpp"

namespace hotpath {

/// One executed job, of whatever origin.
struct ExecutedJob {
  TaskId task = kNoTask;
  Time timestamp{}, start{};
  Time finish = Time::min();  ///< Time::min(): not finished at the end of the run.
  Time next_call = kNever;    ///< Timers: the timer's next call as read at the start of the job.

  bool finished() const { return finish >= start; }
};

/// The executed jobs of one run by start, with instants since its epoch.
struct Schedule {
  TaskSet set;
  std::vector<ExecutedJob> jobs;
};

/// From a trace: jobs that ran or were running. A timer's next call at the start of a job follows the latest
/// timestamp that had been released, or skipped with it, by then.
Schedule schedule_of(const TaskSet& set, const Trace& trace);

/// From a golden trace. It holds no timestamps: they follow from the next calls. A job that the timer's own
/// call started (wait sets, release-and-execute) has the timer's next call at the previous job; one that a
/// releaser started (`release_only`) has the timestamp of its number.
Schedule schedule_of(const GoldenTrace& trace, bool release_only);

/// The authors' response time (their sensor.hpp): finish - (next call at the start - period). Under a
/// release-only executor with backlog that refers to a later release than the job's own.
Duration response_authors(const Schedule& schedule, const ExecutedJob& job);

struct TaskComparison {
  std::string task;
  double lost_percent[2] = {0, 0};  ///< Of the timestamps until the shorter run's last start.
};

/// Two runs of one task set side by side: [0] what was measured, [1] what was predicted.
struct ScheduleComparison {
  std::size_t jobs[2] = {0, 0};
  double similarity = 0;  ///< Of the order of the first 10000 jobs (job_order.hpp).
  /// The same for the order by_period().
  double similarity_by_period = 0;
  struct Difference {
    std::size_t place = 0;
    Time at{};
    std::string task[2];
  };
  std::optional<Difference> first_difference;
  std::vector<TaskComparison> tasks;
  Quantiles lateness_ms[2];          ///< Start minus timestamp.
  Quantiles response_ms[2];          ///< Finish minus timestamp.
  Quantiles response_authors_ms[2];  ///< Timers.

  double largest_loss_difference() const;
};
ScheduleComparison compare(const Schedule& measured, const Schedule& predicted);

}  // namespace hotpath
