// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/platform.hpp"
#include "program/json_record.hpp"
#include "results/schedule.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"

/// The comparisons of `hotpath diff --simulated` and `paper golden`; the template validation.txt.j2 of
/// hotpath_report explains their quality and limits. Keys of rows end with their units. The functions that
/// make rows throw UsageError and InputError for unreadable files.
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

/// Shares of lost jobs agree up to this difference in percentage points.
inline constexpr double kSameLoss_percent = 2;

/// {measured_ms, simulated_ms, median: {differs_percent, agrees}}: the simulated median is compared with the
/// measured one (null if this is 0), and agrees within a tolerance, a share of it.
nlohmann::json compare_latencies(const Quantiles& measured, std::vector<double> simulated_ms,
                                 double tolerance);

/// The latencies in a row of rclcpp_autoware_phases.csv.
Quantiles real_latencies(const CsvReader& row);

/// The largest difference between the phases of `set` and other first timestamps, by task.
double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first);

/// The simulator against the real stack, job by job, for the golden traces REFERENCE/traces/SET.EXECUTOR.csv.
nlohmann::json golden_rows(const std::filesystem::path& reference);
/// Lost jobs and the authors' response times of the real stack's longer runs, rclcpp_timers_only.csv. The
/// phases of those runs are unknown: predictions are ranges over creation steps.
nlohmann::json timers_only_rows(const std::filesystem::path& reference);
/// The hot-path latency of Autoware with the real stack's phases, rclcpp_autoware_phases.csv. Medians agree
/// within 5 %, with several workers 10 %.
nlohmann::json autoware_rows(const std::filesystem::path& reference);

/// A run's schedule compared with the golden trace of the graph's task set under the same executor; null if
/// there is none.
nlohmann::json against_golden(const std::filesystem::path& reference, const std::string& graph,
                              const results::Schedule& run, const ExecutorEntry& executor);

/// Validates stored runs; stores the result in `output` (by default a new folder of runs/), prints
/// and draws it. Throws UsageError, and InputError for unreadable files.
void validate_runs(const std::vector<std::string>& runs, const std::string& output);

/// The same for the simulator against the real stack, on all reference measurements in `reference`
/// (by default as installed with hotpath).
void validate_simulator(const std::string& reference, const std::string& output);

}  // namespace hotpath::validation
