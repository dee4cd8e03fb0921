// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath::imports {

/// The chain of `--chain SOURCE,...:SINK`, from nodes or tasks, with all tasks between them. Throws
/// UsageError if there is no such chain.
[[nodiscard]] Chain chain_of(const std::string& text, const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath::imports
