// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/reference_system/graph_edges.hpp"

namespace hotpath {

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

}  // namespace hotpath
