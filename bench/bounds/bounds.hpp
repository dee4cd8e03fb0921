// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath::bounds {

/// The graph in the form that the analyses take. With `phases_known` it has the phases of the task
/// set. Throws AnalysisError for nodes of type callbacks whose publication rules no method covers.
CallbackGraph callback_graph(const Graph& graph, const GraphTasks& tasks, bool phases_known);

/// The graph under an executor on the machine of its platform. `callbacks` must outlive it.
BoundedSystem bounded_system(const Graph& graph, const CallbackGraph& callbacks,
                             const ExecutorEntry& executor, const SchedulerOptions& options);

}  // namespace hotpath::bounds
