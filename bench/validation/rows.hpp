// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/platform.hpp"
#include "program/json_record.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

/// The rows of validation.json; their keys end with their units. The functions throw UsageError and
/// InputError for unreadable files.
namespace hotpath::validation {

/// Shares of lost jobs agree up to this difference in percentage points.
inline constexpr double kSameLoss_percent = 2;

/// {measured_ms, simulated_ms, median: {differs_percent, agrees}}: the simulated median is compared with the
/// measured one (null if this is 0), and agrees within a tolerance, a share of it.
nlohmann::json compare_latencies(const LatencyQuantiles& measured, std::vector<double> simulated_ms,
                                 double tolerance);

/// The latencies in a row of rclcpp_autoware_phases.csv.
LatencyQuantiles real_latencies(const CsvReader& row);

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

}  // namespace hotpath::validation
