// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::simulated {

/// One simulation of a graph under an executor or a deployment.
struct Plan {
  const setup::ExecutorSpec& executor;
  const Graph& graph;       ///< Its platform describes the machine.
  const GraphTasks& tasks;  ///< With the phases of this repetition.
  const ExecutionTimes& times;
  Duration warm_up{}, duration{};  ///< The run takes the sum of both.
  Duration start{};                ///< When the executors begin to spin.
  /// Released jobs that may wait before the system counts as overloaded; by default 100 per task,
  /// and more below full load.
  std::optional<std::uint64_t> max_backlog = {};
};

/// Returns trace, expected totals, and the chain records after the warm-up; without `keeps_jobs` the measures
/// of the jobs instead of the jobs. Throws SimulationError, InputError.
[[nodiscard]] results::Repetition simulate_repetition(const Plan& plan, bool keeps_jobs = true);

/// `times` with releases drawn uniformly, if any timer has release_jitter.
[[nodiscard]] std::unique_ptr<ExecutionTimes> with_drawn_releases(std::unique_ptr<ExecutionTimes> times,
                                                                  const GraphTasks& tasks,
                                                                  std::uint64_t seed);

/// The execution times that the graph's platform sets, with drawn releases.
[[nodiscard]] std::unique_ptr<ExecutionTimes> execution_times_of(const Graph& graph, const GraphTasks& tasks,
                                                                 std::uint64_t seed);

}  // namespace hotpath::simulated
