// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

/// The system of a stored run as it ran: every command that simulates, bounds, exports or replays a run takes
/// it from here, so that no option of the run is forgotten.
struct StoredSystem {
  CommonOptions options;                 ///< The run's, with its single executors.
  Graph graph;                           ///< Scaled; the platform of a live run is that of the graph's file.
  GraphTasks tasks;                      ///< Of the graph, without the phases of a repetition.
  std::vector<ExecutorSpec> executors;   ///< In the order of the run's, deployments included.
  std::optional<std::uint64_t> backlog;  ///< Of a simulation, where --max-backlog was given.
  bool simulated = false;                ///< By `hotpath simulate`: same seed, same schedule.
  std::string execution_times;           ///< Of a simulation: a model, or `replay:RUN`.

  /// Throws std::out_of_range unless it is one of the run's.
  [[nodiscard]] const ExecutorSpec& executor(const std::string& label) const;
  /// With the phases of that repetition of `run`, whose system this is. Throws as first_timestamps().
  [[nodiscard]] GraphTasks tasks_of(const StoredRun& run, const std::string& label,
                                    std::uint32_t repetition) const;
};

/// Rebuilds the system from run.json and the graph's file, or `graph`, a name or path in place of it. Keys
/// that an older version did not write have the value that this version had. Throws UsageError for a graph
/// that has changed since, InputError and UsageError for what cannot be read.
[[nodiscard]] StoredSystem stored_system(const StoredRun& run, const std::string& graph = "");

}  // namespace hotpath
