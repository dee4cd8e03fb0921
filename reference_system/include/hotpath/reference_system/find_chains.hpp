// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Chains of a graph that names none: from timers to tasks whose data reaches no other, by way of cyclic
/// nodes as well. One for each such pair, along the path with the most tasks, and of these the one with the
/// most work; at most `most` of them, by number of tasks and then by work, the largest first. They are called
/// chain_1, chain_2 and so on. Cycles by way of timers are cut where a search from the timer closes them.
[[nodiscard]] std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most);

}  // namespace hotpath
