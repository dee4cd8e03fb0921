// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Draws the graph in Graphviz's language, data flowing from left to right: shape and colour by node type,
/// the period of timers, the execution time of nodes that work, topics whose name is not their publisher's.
/// Nodes and edges of the first chain are red and bold.
void write_dot(std::ostream& out, const Graph& graph);

}  // namespace hotpath
