// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_edges.hpp"

#include <algorithm>

#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

namespace {

/// The tasks of the graph's first chain.
std::vector<bool> hot_tasks(const Graph& graph, const GraphTasks& tasks) {
  std::vector<bool> hot(tasks.set.size(), false);
  if (graph.chains.empty()) return hot;
  for (const std::string& node : graph.chains.front().nodes) {
    for (const TaskId id : tasks_named(graph, tasks, node)) hot[id] = true;
  }
  return hot;
}

/// Whether a hot task publishes the edge's topic to a hot task.
bool is_hot(const GraphEdge& edge, const GraphTasks& tasks, const std::vector<bool>& hot) {
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!hot[id] || tasks.origin[id].node != edge.source) continue;
    for (std::size_t p = 0; p < tasks.readers[id].size(); ++p) {
      if (tasks.callbacks[id].publishes[p].topic != edge.topic) continue;
      const auto reaches = [&](TaskId to) { return hot[to] && tasks.origin[to].node == edge.target; };
      const std::vector<TaskId>& readers = tasks.readers[id][p];
      if (std::any_of(readers.begin(), readers.end(), reaches)) return true;
    }
  }
  return false;
}

}  // namespace

bool on_hot_path(const Graph& graph, const Node& node) {
  if (graph.chains.empty()) return false;
  const std::vector<std::string>& nodes = graph.chains.front().nodes;
  return std::any_of(nodes.begin(), nodes.end(),
                     [&](const std::string& name) { return graph.find(name) == &node; });
}

std::vector<GraphEdge> graph_edges(const Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  const std::vector<bool> hot = hot_tasks(graph, tasks);
  std::vector<GraphEdge> edges;
  for (std::uint32_t s = 0; s < graph.nodes.size(); ++s) {
    const Node& source = graph.nodes[s];
    const bool leads_on = !graph.chains.empty() && graph.find(graph.chains.front().sink) != &source;
    for (const std::string& topic : source.outputs) {
      for (std::uint32_t t = 0; t < graph.nodes.size(); ++t) {
        const Node& target = graph.nodes[t];
        const auto subscribes = [&](const Input& input) { return input.topic == topic; };
        if (std::none_of(target.inputs.begin(), target.inputs.end(), subscribes)) continue;
        edges.push_back({s, t, topic, false});
        edges.back().hot = leads_on && is_hot(edges.back(), tasks, hot);
      }
    }
  }
  return edges;
}

}  // namespace hotpath
