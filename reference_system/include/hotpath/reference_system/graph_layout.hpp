// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/reference_system/graph_edges.hpp"

namespace hotpath {

/// Where to draw a node, in units of one node's width and height.
struct GraphPosition {
  double column = 0;  ///< Edges on the longest way from a source: data flows from left to right.
  double row = 0;     ///< Centred: the middle of every column is 0.
};

/// A position for each node, no two alike. Rows are ordered by the mean of their neighbours' (the barycentre
/// method of Sugiyama, Tagawa and Toda, 1981), best of some sweeps. In a graph with cycles, edges that close
/// one go back.
std::vector<GraphPosition> graph_layout(const Graph& graph);

/// Crossings of straight edges, and nodes that lie on an edge of others.
std::size_t crossings(const std::vector<GraphEdge>& edges, const std::vector<GraphPosition>& positions);

}  // namespace hotpath
