// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// What theory guarantees under one executor by one method.
struct BoundSet {
  std::string executor;
  std::string method;  ///< Author and year.
  /// Worst-case response time of each task, from its timestamp; none: no bound. Empty: the method is not one
  /// for tasks.
  std::vector<std::optional<Duration>> tasks;
  /// Largest end-to-end latency (finish of the sink minus timestamp of the source) of each chain of the
  /// graph.
  std::vector<std::optional<Duration>> chains;
  std::string refusal;  ///< Why the method does not apply, and which would; empty: it does.
};

/// Why no method covers the graph under any executor; none: some may.
std::optional<std::string> refusal_of(const Graph& graph);

/// All methods that analyse `executor` on the graph's tasks. `delta`: release overhead (paper, Section V-B),
/// >= 0.
std::vector<BoundSet> bounds_of(const Graph& graph, const GraphTasks& tasks, const ExecutorEntry& executor,
                                Duration delta);

/// End-to-end latency of data that a chain of timers, which read what the one before last wrote, hands on.
struct ChainBound {
  std::string method;
  std::optional<Duration> latency;
  std::string refusal;
};

/// The methods for `names`, timers of the graph, under `executor`. Throws AnalysisError for an unknown name.
std::vector<ChainBound> timer_chain_bounds(const GraphTasks& tasks, const ExecutorEntry& executor,
                                           Duration delta, const std::vector<std::string>& names);

}  // namespace hotpath
