// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The chain that `--chain SOURCE,...:SINK` names: nodes or tasks, with all tasks that lie between. Throws
/// UsageError where there is none.
[[nodiscard]] Chain chain_of(const std::string& text, const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath
