// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "program/json_record.hpp"
#include "results/schedule.hpp"
#include "results/summary.hpp"

/// The comparisons of `hotpath diff --simulated` and `paper golden`; the template validation.txt.j2 of
/// hotpath_report explains their quality and limits.
namespace hotpath::validation {

/// One of two runs of a task set, until the shorter one's last start.
struct ScheduleSide {
  std::size_t jobs = 0;
  std::map<std::string, double> lost_percent;  ///< By timer: of the timestamps until then.
  Quantiles start_lateness_ms;                 ///< Start minus timestamp.
  Quantiles response_ms;                       ///< Finish minus timestamp.
  Quantiles response_authors_ms;               ///< Timers.
};
HOTPATH_FIELDS(ScheduleSide, jobs, lost_percent, start_lateness_ms, response_ms, response_authors_ms);

/// Two runs of one task set side by side: a measured one, and another one.
struct ScheduleComparison {
  double similarity = 0;            ///< Of the order of the first 10000 jobs (job_order.hpp).
  double similarity_by_period = 0;  ///< The same with the order by_period().
  struct Difference {
    std::size_t place = 0;
    double at_ms = 0;             ///< Start of the measured job.
    std::string measured, other;  ///< Tasks.
  };
  std::optional<Difference> first_difference;
  double largest_loss_difference_percent = 0;  ///< Over all timers.
  /// Order of jobs and losses agree within the simulator's tolerances for golden traces.
  bool agrees = false;
  ScheduleSide measured, other;
};
HOTPATH_FIELDS(ScheduleComparison::Difference, place, at_ms, measured, other);
HOTPATH_FIELDS(ScheduleComparison, similarity, similarity_by_period, first_difference,
               largest_loss_difference_percent, agrees, measured, other);
ScheduleComparison compare_schedules(const results::Schedule& measured, const results::Schedule& other);

/// Hot-path latencies (ms) of a simulation, a run or the real stack.
struct LatencyQuantiles {
  std::optional<std::size_t> n;  ///< None: unknown.
  double p10 = kNoValue, p50 = kNoValue, p90 = kNoValue, p99 = kNoValue, max = kNoValue;
};
HOTPATH_FIELDS(LatencyQuantiles, n, p10, p50, p90, p99, max);
LatencyQuantiles latency_quantiles(std::vector<double> samples_ms);

/// Validates stored runs; stores the result in `output` (by default a new folder of runs/), prints
/// and draws it. Throws UsageError, and InputError for unreadable files.
void validate_runs(const std::vector<std::string>& runs, const std::string& output);

/// The same for the simulator against the real stack, on all reference measurements in `reference`
/// (by default as installed with hotpath).
void validate_simulator(const std::string& reference, const std::string& output);

}  // namespace hotpath::validation
