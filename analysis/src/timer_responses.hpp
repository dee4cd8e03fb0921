// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "hotpath/analysis/release_overhead.hpp"

namespace hotpath {

/// The bounds that `bound` fills in; only the reason if an assumption is missing or `bound` throws
/// AnalysisError.
GraphBounds attempt(const char* method, std::uint32_t missing,
                    const std::function<void(GraphBounds&)>& bound);

/// Fills in the bounds of all tasks and chains.
void bound_graph(const GraphTopology& topology, const PathBounds& paths, GraphBounds& out);

/// Ranks of the paper's priority order (priority, then subscriptions before timers, then timers by
/// task). Without fixed priorities all levels are equal.
GraphOrder priority_ranks(const BoundedSystem& system);

/// Applies `analysis` to a system of timers only, with the costs of dispatches and releases. Throws
/// AnalysisError.
OverheadAwareResponse timer_responses(const BoundedSystem& system, const ResponseTimeAnalysis& analysis);

}  // namespace hotpath
