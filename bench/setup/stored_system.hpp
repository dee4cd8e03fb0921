// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::setup {

/// The system of a stored run. Every command that simulates, bounds, exports or replays a run uses
/// it, so that no option of the run is lost.
struct StoredSystem {
  CommonOptions options;                 ///< Of the run, with its executors but not its deployments.
  Graph graph;                           ///< Scaled; a live run has the platform of the graph's file.
  GraphTasks tasks;                      ///< Of the graph, without the phases of a repetition.
  std::vector<ExecutorSpec> executors;   ///< In the run's order, deployments included.
  std::optional<std::uint64_t> backlog;  ///< Of a simulation with --max-backlog.
  bool simulated = false;                ///< By `hotpath simulate`: same seed, same schedule.
  std::optional<TimesSource> times;      ///< Of a simulation; none: recorded.

  /// Throws std::out_of_range if the run has no such executor.
  [[nodiscard]] const ExecutorSpec& executor(const std::string& label) const;
  /// The tasks with the phases of a repetition of `run`, whose system this is. Throws like
  /// first_timestamps().
  [[nodiscard]] GraphTasks tasks_of(const results::StoredRun& run, const std::string& label,
                                    std::uint32_t repetition) const;
};

/// Rebuilds the system from run.json and the run's copy of the graph, or from `graph`, another name or path.
/// Throws UsageError if the graph has changed since, InputError and UsageError for unreadable files.
[[nodiscard]] StoredSystem stored_system(const results::StoredRun& run, const std::string& graph = "");

}  // namespace hotpath::setup
