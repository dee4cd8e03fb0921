// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The physical lower limit of the age of a chain's data: its computation, from the start of a source to the
/// finish of the sink, if nothing else runs. For Autoware's hot path: 5 and 6 crunches.
struct ChainLimits {
  Duration one_core_per_branch{};  ///< Work of the nodes on the longest branch.
  Duration one_thread{};           ///< Work of all nodes.
};
/// The limits of a chain of a valid graph.
ChainLimits chain_limits(const Graph& graph, const Chain& chain);

/// Derives chains for a graph without chains: from timers to tasks whose data reaches no other
/// task, also through cyclic nodes. Returns one chain per pair, along the path with the most tasks,
/// and among these with the most work; at most `most` chains, sorted by number of tasks and then by
/// work, largest first. They are called chain_1, chain_2 and so on. A cycle through timers is cut
/// where a search from the timer closes it.
[[nodiscard]] std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most);

}  // namespace hotpath
