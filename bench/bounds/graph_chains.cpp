// SPDX-License-Identifier: Apache-2.0
#include "bounds/graph_chains.hpp"

#include <algorithm>
#include <functional>
#include <string>

namespace hotpath {

std::optional<TaskId> source_of_sequence(const Graph& graph, const GraphTasks& tasks, const Chain& chain) {
  if (chain.sources.size() != 1) return std::nullopt;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin origin = tasks.origin[id];
    if (!origin.input && graph.nodes[origin.node].name == chain.sources.front()) return id;
  }
  return std::nullopt;
}

std::vector<std::vector<TaskId>> task_paths(const Graph& graph, const GraphTasks& tasks, const Chain& chain) {
  const auto node_of = [&](TaskId id) { return graph.nodes[tasks.origin[id].node].name; };
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::vector<std::vector<TaskId>> paths;
  std::vector<TaskId> path;
  const std::function<void(TaskId)> walk = [&](TaskId id) {
    if (!has(chain.nodes, node_of(id))) return;
    path.push_back(id);
    if (node_of(id) == chain.sink) {
      paths.push_back(path);
    } else {
      for (const TaskId next : tasks.set[id].feeds) walk(next);
    }
    path.pop_back();
  };
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.origin[id].input && has(chain.sources, node_of(id))) walk(id);
  }
  return paths;
}

}  // namespace hotpath
