// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "setup/run_setup.hpp"

namespace hotpath::advise {

/// The command line of `hotpath advise`.
struct Options : setup::CommonOptions {
  std::optional<std::string> objective;  ///< By default as the help of --for says.
  std::string now = "default";           ///< The system's current executor or deployment.
  std::optional<bool> reference_costs;   ///< --costs reference, not graph; by default as its help says.
  std::optional<unsigned> cores;
  std::uint32_t draws = 20;
  double budget_s = 120;
  unsigned threads = 0;
  bool choose_phases = false;       ///< advise_phases() instead of advise().
  std::optional<double> margin_ms;  ///< advise_phases(): how far offsets may be off; >= 0.
  /// advise(): the contract of a graph under an executor as YAML, for `hotpath watch`.
  std::function<std::string(const Graph&, const GraphTasks&, const setup::ExecutorSpec&)> contract;
};

/// Predicts the graph under every suitable executor and deployment, ranks them, repeats the ranking
/// under changed assumptions, and writes table, figure, advice and the files of the recommended
/// change. Throws UsageError, InputError, RunError.
void advise(const Options& options);

/// Searches phases of timers that minimise a guaranteed latency, under each executor that the exact worst
/// cases cover, and writes the best as a file for --phases, with schedules that reach the guarantee.
/// Throws UsageError, InputError, and RunError if nothing is covered.
void advise_phases(const Options& options);

}  // namespace hotpath::advise
