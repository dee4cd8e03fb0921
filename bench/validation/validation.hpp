// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace hotpath {

/// Each compares predictions of the simulator with measurements and returns one JSON object per comparison,
/// with a sentence `verdict`. Units are the endings of keys. All throw UsageError or GraphError for files
/// that cannot be read.

/// The golden traces of the timers-only sets in REFERENCE/traces, job by job, without and with costs.
nlohmann::json validate_golden_traces(const std::filesystem::path& reference);

/// REFERENCE/rclcpp_timers_only.csv: lost jobs and the authors' response times. The phases of those runs are
/// unknown: predictions are ranges over creation steps.
nlohmann::json validate_timers_only(const std::filesystem::path& reference);

/// REFERENCE/rclcpp_autoware_phases.csv: quantiles of the hot-path latency.
nlohmann::json validate_autoware(const std::filesystem::path& reference);

/// Every executor and repetition of a run, live or simulated, against the simulation with its phases and
/// measured execution times, and against what REFERENCE has of the real stack on the same graph: the golden
/// trace of the set and executor, or Autoware's latencies at the same load.
nlohmann::json validate_run(const std::filesystem::path& run, const std::filesystem::path& reference);

}  // namespace hotpath
