// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/tracing/event.hpp"

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

/// Epoch of exported traces, 2001-09-09; the epoch of a run is zero.
inline constexpr Time kExportedEpoch = from_ns(1'000'000'000'000'000'000);

/// A run to export as events of ros2_tracing.
struct ExportedRun {
  const Graph& graph;
  const GraphTasks& tasks;  ///< With the run's phases.
  Trace trace;
  std::vector<bool> polled;                  ///< By worker: its executor emits events of its waits.
  std::vector<std::vector<int>> processors;  ///< By worker: where it may run; empty or missing: everywhere.
  std::vector<bool> states_jobs = {};  ///< By worker: its executor states its jobs, as PriorityExecutor.
  bool jazzy = false;                  ///< As rclcpp 28 (rcl 9), else as rclcpp 26 (rcl 8).
  unsigned cores = 1;
};

/// Events that own their texts.
struct RunEvents {
  std::vector<tracing::Event> events;
  std::shared_ptr<const void> texts;
};

/// The events that ros2_tracing would have recorded. `distinct`: those of two processors are 1 ns apart,
/// because readers of traces merge their streams by time alone. The run must outlive the events.
[[nodiscard]] RunEvents events_of(const ExportedRun& run, bool distinct);

}  // namespace hotpath::imports
