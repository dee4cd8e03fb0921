// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

class RunTotals;

/// One simulation of a graph under an executor or a deployment.
struct SimulationPlan {
  const ExecutorSpec& executor;
  const Graph& graph;                        ///< Its platform is the machine.
  const GraphTasks& tasks;                   ///< With the phases.
  const std::vector<MeasuredChain>& chains;  ///< Of the graph.
  const ExecutionTimes& times;
  Duration warm_up{}, duration{};  ///< The run is as long as both.
  /// Released jobs that may wait before the system counts as overloaded.
  std::uint64_t max_backlog = 100 * static_cast<std::uint64_t>(tasks.set.size());
};

/// Its trace and accounts, with the chain records that count. With `totals`, which are of this plan, no jobs
/// are kept, and no end-to-end latency is known. Throws SimulationError, InputError.
[[nodiscard]] Repetition simulate_repetition(const SimulationPlan& plan, RunTotals* totals = nullptr);

/// Those that the graph's platform asks for.
[[nodiscard]] std::unique_ptr<ExecutionTimes> execution_times_of(const Graph& graph, const GraphTasks& tasks,
                                                                 std::uint64_t seed);

}  // namespace hotpath
