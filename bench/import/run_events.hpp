// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/tracing/event.hpp"

namespace hotpath {

/// A run to export as events of ros2_tracing.
struct ExportedRun {
  const Graph& graph;
  const GraphTasks& tasks;  ///< With the run's phases.
  Trace trace;
  std::vector<bool> polled;  ///< By worker: its executor emits events of its waits.
  bool jazzy = false;        ///< As rclcpp 28 (rcl 9), else as rclcpp 26 (rcl 8).
  unsigned cores = 1;
};

/// Events in the order of time. Their texts belong to the exported graph and tasks, or are `names`.
struct RunEvents {
  std::vector<tracing::Event> events;
  std::unordered_set<std::string> names;
};

/// The events that ros2_tracing would have recorded: before the run the initialisation of nodes,
/// publishers, subscriptions and timers, then takes, callbacks, publications and waits. As in ROS
/// 2, jobs that never started have no events.
[[nodiscard]] RunEvents run_events(const ExportedRun& run);

}  // namespace hotpath
