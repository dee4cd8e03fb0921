// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The exact worst cases of one executor thread for the phases that `tasks` has and any execution times
/// between the best and the worst case of each task: response times of timers, and age of data and hot-path
/// latency of chains that begin in timers (executor/src/core/exploration.cpp). `max_states` bounds time and
/// memory. A refusal says what is not covered.
[[nodiscard]] GraphBounds exact_worst_cases(const Graph& graph, const GraphTasks& tasks,
                                            const ExecutorEntry& executor, const SchedulerOptions& scheduling,
                                            std::size_t max_states);

}  // namespace hotpath
