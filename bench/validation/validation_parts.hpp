// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "setup/executor_spec.hpp"
#include "validation/schedule_comparison.hpp"

namespace hotpath {

/// At most 255 bytes.
std::string text(const char* format, auto... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof(buffer), format, values...);
  return buffer;
}

/// Shares of lost jobs that differ by no more than this many points are the same.
inline constexpr double kSameLoss_percent = 2;

/// The order of jobs and the losses agree as well as the simulator is to meet the golden traces.
bool agrees(const ScheduleComparison& comparison);

/// `first` and `second` name the two sides in keys.
nlohmann::json comparison_json(const ScheduleComparison& comparison, const std::string& first,
                               const std::string& second);

nlohmann::json latency_json(std::vector<double> samples);
/// Of a row of rclcpp_autoware_phases.csv.
nlohmann::json real_latency_json(const CsvReader& row);

/// Whether two medians agree within a share `tolerance`; if not, `otherwise` says why.
std::string median_verdict(double measured, double simulated, double tolerance, const std::string& otherwise);

struct Prediction {
  Trace trace;
  std::vector<std::vector<double>> latencies_ms;  ///< Hot-path latencies of each chain after the warm-up.
};
Prediction predict(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec& executor,
                   const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up);

}  // namespace hotpath
