// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/schedule.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

/// What a simulation says that a graph does.
struct Prediction {
  Trace trace;
  std::vector<std::vector<double>> latencies_ms;  ///< Hot-path latencies of each chain after the warm-up.
};
Prediction predict(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec& executor,
                   const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up);

/// What it says of timers whose jobs, as those of the golden programs and of the authors' nodes, work until
/// an instant of the clock.
Schedule predict_timers(const TaskSet& set, const ExecutorEntry& executor, Platform platform,
                        Duration duration);

}  // namespace hotpath
