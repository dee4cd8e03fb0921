// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath::imports {

/// The command line of `hotpath import ctf`.
struct CtfOptions {
  std::string trace;                   ///< Folder of a CTF trace.
  std::string output;                  ///< Folder of the results.
  std::vector<std::string> executors;  ///< Names in the registry; empty: inferred.
  std::string deployment;              ///< Deployment of the recorded threads; empty: inferred.
  std::vector<std::string> chains;     ///< Each `SOURCE,...:SINK`; empty: found in the graph.
  unsigned cores = 0;                  ///< Processors of the recorded system; 0: those in the trace.
  std::uint64_t jobs = 100'000;        ///< First jobs of the trace, of which all results are.
};

/// Reads a trace of ros2_tracing, simulates the recording, compares, and writes all results. Throws
/// UsageError if the folder holds no readable trace of ros2_tracing, RunError for other failures.
void import_ctf(const CtfOptions& options);

/// Writes a stored run as a CTF trace with the events of ros2_tracing. Throws UsageError, RunError.
void export_ctf(const std::string& run, const std::string& output);

}  // namespace hotpath::imports
