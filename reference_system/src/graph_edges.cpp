// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_edges.hpp"

#include <algorithm>

namespace hotpath {

bool on_hot_path(const Graph& graph, const Node& node) {
  if (graph.chains.empty()) return false;
  const std::vector<std::string>& nodes = graph.chains.front().nodes;
  return std::any_of(nodes.begin(), nodes.end(),
                     [&](const std::string& name) { return graph.find(name) == &node; });
}

std::vector<GraphEdge> graph_edges(const Graph& graph) {
  std::vector<GraphEdge> edges;
  for (std::uint32_t s = 0; s < graph.nodes.size(); ++s) {
    const Node& source = graph.nodes[s];
    const bool leads_on = on_hot_path(graph, source) && graph.find(graph.chains.front().sink) != &source;
    for (const std::string& topic : source.outputs) {
      for (std::uint32_t t = 0; t < graph.nodes.size(); ++t) {
        const Node& target = graph.nodes[t];
        const auto subscribes = [&](const Input& input) { return input.topic == topic; };
        if (std::none_of(target.inputs.begin(), target.inputs.end(), subscribes)) continue;
        edges.push_back({s, t, topic, leads_on && on_hot_path(graph, target)});
      }
    }
  }
  return edges;
}

}  // namespace hotpath
