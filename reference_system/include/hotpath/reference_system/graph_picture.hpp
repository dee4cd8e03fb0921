// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Draws the graph in Graphviz's language, data flowing from left to right: shape and colour by node type,
/// the period of timers, the execution time of nodes that work, topics whose name is not their publisher's.
/// Nodes and edges of the first chain are red and bold.
void write_dot(std::ostream& out, const Graph& graph);

/// The same, nodes coloured by the executor that serves them, with a legend. Of a node whose callbacks belong
/// to several executors, that of the first callback colours it.
void write_dot(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment);

}  // namespace hotpath
