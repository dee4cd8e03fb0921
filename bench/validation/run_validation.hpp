// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "validation/latency_quantiles.hpp"
#include "validation/run_against_golden.hpp"
#include "validation/schedule_comparison.hpp"

namespace hotpath {

/// A run's hot-path latencies, after the warm-up.
struct RunLatencies {
  LatencyQuantiles run, simulated;
  /// Autoware at the same load only: the real stack's, and by how much the phases differ at most.
  std::optional<LatencyQuantiles> real;
  std::optional<double> phases_differ_ms;
};

/// One executor and repetition of a stored run, live or simulated, against the simulation with its phases and
/// measured execution times, and against what the reference has of the real stack on the same graph.
struct RunValidation {
  std::string run, executor;  ///< Folder, label.
  std::uint32_t repetition = 0;
  ScheduleComparison comparison;          ///< Run, simulation.
  std::optional<RunLatencies> latencies;  ///< Of graphs with chains.
  std::optional<RunAgainstGolden> golden;
  std::string verdict;

  std::string name() const { return executor + " #" + std::to_string(repetition); }
};

/// Every executor and repetition of a run, in the order of the executors. Throws UsageError, InputError.
std::vector<RunValidation> validate_run(const std::filesystem::path& run,
                                        const std::filesystem::path& reference);

}  // namespace hotpath
