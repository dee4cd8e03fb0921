// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace hotpath
