// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "import/ctf_writer.hpp"

namespace hotpath {

/// How a run is told as events of ros2_tracing.
struct ExportedRun {
  const Graph& graph;
  const GraphTasks& tasks;  ///< With the run's phases.
  Trace trace;
  std::vector<bool> polled;  ///< By worker: it belongs to an executor with events of its waits.
  bool jazzy = false;        ///< As rclcpp 28 (rcl 9), else as rclcpp 26 (rcl 8).
  unsigned cores = 1;
};

/// The events that ros2_tracing would have recorded: initialisation of nodes, publishers, subscriptions and
/// timers, which lies before the run, then takes, callbacks, publications and waits. Jobs that never started
/// leave no events, as in ROS 2.
[[nodiscard]] WrittenTrace run_events(const ExportedRun& run);

}  // namespace hotpath
