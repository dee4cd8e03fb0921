// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_layout.hpp"
#include "program/text.hpp"

namespace hotpath::telemetry {

/// Describes one repetition and its graph: nodes with a layout, connections and chains. The caller
/// fills in the other fields. The `run_id` is unique per repetition, also among concurrent runs.
inline telemetry::RunInfo make_run_info(const Graph& graph, const std::string& executor,
                                        std::uint32_t repetition, std::int64_t epoch_ns) {
  telemetry::RunInfo info;
  info.run_id(program::concat(epoch_ns, "-", executor, "-", repetition));
  info.graph(graph.name);
  info.executor(executor);
  info.repetition(repetition);
  info.epoch_ns(epoch_ns);
  const std::vector<GraphPosition> positions = graph_layout(graph);
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    const Node& node = graph.nodes[n];
    telemetry::NodeInfo& i = info.nodes().emplace_back();
    i.name(node.name);
    i.type(to_string(node.type));
    i.hot(on_hot_path(graph, node));
    i.layout_x(positions[n].column);
    i.layout_y(positions[n].row);
    if (node.type != NodeType::callbacks) i.deadline_ns(node.callbacks.back().deadline.count());
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

/// Unix time, in nanoseconds, of the time point `from_now` after now.
inline std::int64_t unix_ns(Duration from_now) {
  const auto now = std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now());
  return (now.time_since_epoch() + from_now).count();
}

}  // namespace hotpath::telemetry
