// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::explain {

/// A simulation with the records of its jobs and chains.
struct SimulatedRun {
  std::string name;
  const setup::ExecutorSpec& executor;
  const Graph& graph;
  const GraphTasks& tasks;
  const ExecutionTimes& times;
  const Trace& trace;
};

/// Why one is faster than the other along a chain of the graph: up to three sentences. Both have the
/// same tasks, phases and execution times.
[[nodiscard]] std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b,
                                                  std::uint32_t chain);

}  // namespace hotpath::explain
