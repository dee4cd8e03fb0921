// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath {

/// What `hotpath import ctf` is told on the command line.
struct ImportCtfOptions {
  std::string trace;                ///< Folder of a CTF trace.
  std::string output;               ///< Folder of the results.
  std::string executor;             ///< Of the registry; empty: inferred.
  std::string deployment;           ///< File that says how the recorded threads ran; empty: inferred.
  std::vector<std::string> chains;  ///< Each `SOURCE,...:SINK`; empty: found.
  unsigned cores = 0;               ///< Processors that the recorded system had; 0: those seen in the trace.
  std::uint64_t jobs = 100'000;     ///< From the first so many are rules, times, chains and self-check.
};

/// Reads a trace of ros2_tracing and writes graph, execution times, a run folder, deployment and page; then
/// simulates what was recorded and compares. Throws UsageError for what is no such trace, RunError when
/// nothing could be read of it.
void import_ctf(const ImportCtfOptions& options);

/// Writes the run in a folder as a CTF trace with the events of ros2_tracing. Throws UsageError, RunError.
void export_ctf(const std::string& run, const std::string& output);

}  // namespace hotpath
