// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/tracing/event.hpp"

namespace hotpath::imports {

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
