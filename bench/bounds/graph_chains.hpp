// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The timer of a chain that begins at one node; none for one with several sources.
std::optional<TaskId> source_of_sequence(const Graph& graph, const GraphTasks& tasks, const Chain& chain);

/// All paths along task edges from the chain's sources to its sink.
std::vector<std::vector<TaskId>> task_paths(const Graph& graph, const GraphTasks& tasks, const Chain& chain);

}  // namespace hotpath
