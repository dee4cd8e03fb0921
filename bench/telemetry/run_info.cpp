// SPDX-License-Identifier: Apache-2.0
#include "telemetry/run_info.hpp"

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_layout.hpp"

namespace hotpath {

telemetry::RunInfo make_run_info(const Graph& graph) {
  telemetry::RunInfo info;
  info.graph(graph.name);
  const std::vector<GraphPosition> positions = graph_layout(graph);
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    const Node& node = graph.nodes[n];
    telemetry::NodeInfo& i = info.nodes().emplace_back();
    i.name(node.name);
    i.type(to_string(node.type));
    i.hot(on_hot_path(graph, node));
    i.layout_x(positions[n].column);
    i.layout_y(positions[n].row);
    i.deadline_ns(node.deadline.count());
  }
  for (const GraphEdge& edge : graph_edges(graph)) {
    telemetry::EdgeInfo& i = info.edges().emplace_back();
    i.source(edge.source);
    i.target(edge.target);
    i.topic(edge.topic);
    i.hot(edge.hot);
  }
  for (const ChainIndex& chain : index_chains(graph, make_tasks(graph))) {
    telemetry::ChainInfo& i = info.chains().emplace_back();
    i.name(graph.chains[info.chains().size() - 1].name);
    i.sink(chain.sink);
  }
  return info;
}

std::string make_run_id(std::int64_t epoch_ns, const std::string& executor, std::uint32_t repetition) {
  return std::to_string(epoch_ns) + "-" + executor + "-" + std::to_string(repetition);
}

}  // namespace hotpath
