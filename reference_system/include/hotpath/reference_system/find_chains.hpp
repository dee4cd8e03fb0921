// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Derives chains for a graph without chains: from timers to tasks whose data reaches no other
/// task, also through cyclic nodes. Returns one chain per pair, along the path with the most tasks,
/// and among these with the most work; at most `most` chains, sorted by number of tasks and then by
/// work, largest first. They are called chain_1, chain_2 and so on. A cycle through timers is cut
/// where a search from the timer closes it.
[[nodiscard]] std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most);

}  // namespace hotpath
