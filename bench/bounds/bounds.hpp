// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath::bounds {

/// A chain whose age is bounded. A chain that begins inside other chains is none.
struct BoundedChain : ChainIndex {
  std::uint32_t number = 0;  ///< In the graph.
};
/// In the order of GraphBounds::chains.
[[nodiscard]] std::vector<BoundedChain> bounded_chains(const Graph& graph, const GraphTasks& tasks);

/// The graph in the form that the analyses take. With `phases_known` it has the phases of the task
/// set. Throws AnalysisError for nodes of type callbacks whose publication rules no method covers.
CallbackGraph callback_graph(const Graph& graph, const GraphTasks& tasks, bool phases_known);

/// The smallest bound that a method gives.
struct Guarantee {
  std::int64_t ns = 0;
  std::string method;
};

struct ChainGuarantee {
  std::string name;
  std::optional<Guarantee> age;       ///< End-to-end latency.
  std::optional<Guarantee> hot_path;  ///< Hot-path latency.
};

/// What theory guarantees for a graph under one executor: for any phases, unless a method says for which.
struct Guarantees {
  std::vector<std::optional<Guarantee>> tasks;  ///< Response times, by task.
  std::vector<ChainGuarantee> chains;           ///< Those that begin in timers.

  /// Of the chain's age or hot-path latency; std::nullopt also if the chain does not begin in timers.
  [[nodiscard]] std::optional<Guarantee> of(const std::string& chain, Latency latency) const;
};

/// The smallest of the bounds of all methods; std::nullopt if no method covers the system.
[[nodiscard]] std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                                    const std::vector<GraphBounds>& all_bounds);

}  // namespace hotpath::bounds
