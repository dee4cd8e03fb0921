// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "hotpath/reference_system/live_system.hpp"

namespace hotpath {

/// Creates the nodes on the requested transport. Throws TransportError.
std::unique_ptr<LiveNodes> make_live_nodes(const Graph& graph, const GraphTasks& tasks,
                                           const LiveOptions& options, RunMemory& memory);

}  // namespace hotpath
