// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::simulated {

/// The command line of `simulate`.
struct Options : setup::CommonOptions, setup::PlatformOptions {
  std::optional<setup::TimesSource> execution_times;  ///< By default as in the graph.
  std::optional<std::uint64_t> max_backlog;
  unsigned threads = 0;  ///< 0: one per processor.
  bool no_trace = false;
};

/// Simulates all repetitions of all executors, then writes one result folder, prints the table and
/// draws the figure. The same options give the same files, byte by byte. Throws UsageError,
/// InputError, RunError, and OverloadError if no executor reaches the end of its simulations; then it
/// writes nothing. An executor that does not has a row without results.
void run_simulated(const Options& options);

/// run_simulated() without table and figure. Without a command, the run records words that repeat it: an
/// executor or deployment, graph without scaling, phases, order of entities, duration, seed and times.
/// Throws as run_simulated(), and OverloadError if any executor is overloaded.
void store_simulation(Options options);

/// The summary of run_simulated(), without writing or printing. Throws as store_simulation().
[[nodiscard]] results::Summary summary_of_simulation(const Options& options);

/// Throws the errors with which run_simulated() would not begin.
void check_simulation(const Options& options);

}  // namespace hotpath::simulated
