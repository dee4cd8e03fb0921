// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// A subscription as a connection between two nodes (indices into the graph's nodes).
struct GraphEdge {
  std::uint32_t source = 0, target = 0;
  std::string topic;
  bool hot = false;  ///< Whether the edge is part of the hot path; publications of a chain's sink are not.
};

/// Sorted by publisher in creation order, its outputs, and subscriber in creation order.
std::vector<GraphEdge> graph_edges(const Graph& graph);

/// Whether the graph's first chain visits the node.
bool on_hot_path(const Graph& graph, const Node& node);

/// The position of a node in a drawing, in units of one node's width and height.
struct GraphPosition {
  double column = 0;  ///< Number of edges on the longest path from a source: data flows from left to right.
  double row = 0;     ///< Centred: the middle of every column is 0.
};

/// A distinct position for each node. Rows are ordered by the mean of their neighbours' rows (the
/// barycentre method of Sugiyama, Tagawa and Toda, 1981); the best of several sweeps is returned.
/// In a graph with cycles, the closing edges point backwards.
std::vector<GraphPosition> graph_layout(const Graph& graph);

/// Number of crossings of straight edges, plus the number of nodes that lie on an edge of others.
std::size_t crossings(const std::vector<GraphEdge>& edges, const std::vector<GraphPosition>& positions);

/// Writes the graph in Graphviz's DOT language, data flowing from left to right: shape and colour
/// by node type, the period of timers, the execution time of working nodes, and topics with another
/// name than their publisher. Nodes and edges of the first chain are red and bold. With a deployment,
/// nodes have the colour of the executor of their first callback, and there is a legend.
void write_dot(std::ostream& out, const Graph& graph, const Deployment* deployment = nullptr);

}  // namespace hotpath
