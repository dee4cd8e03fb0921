// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

/// What `simulate` is told on the command line.
struct SimulateOptions : CommonOptions, PlatformOptions {
  std::string phases_of;  ///< Folder of a run whose first timestamps count.
  std::optional<std::string> execution_times;
  std::optional<std::uint64_t> max_backlog;
  unsigned threads = 0;  ///< 0: as many as there are processors.
  bool no_trace = false;
};

/// Simulates all repetitions of all executors, then writes one result folder, prints the table and draws the
/// figure. The same options give the same files, byte by byte. Throws UsageError (OverloadError where a
/// simulation does not get to its end), InputError, RunError; what cannot be simulated to its end leaves
/// nothing behind.
void run_simulated(const SimulateOptions& options);

/// What run_simulated() would summarise, and nothing written or printed. Throws as run_simulated().
[[nodiscard]] Summary summary_of_simulation(const SimulateOptions& options);

/// Throws what keeps run_simulated() from beginning.
void check_simulation(const SimulateOptions& options);

}  // namespace hotpath
