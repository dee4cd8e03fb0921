// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Writes the graph in Graphviz's DOT language, data flowing from left to right: shape and colour
/// by node type, the period of timers, the execution time of working nodes, and topics with another
/// name than their publisher. Nodes and edges of the first chain are red and bold.
void write_dot(std::ostream& out, const Graph& graph);

/// Writes the graph with nodes coloured by executor, and a legend. If several executors serve a
/// node's callbacks, the executor of the first callback determines the colour.
void write_dot(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment);

}  // namespace hotpath
