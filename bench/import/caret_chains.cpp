// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "hotpath/reference_system/chain_observation.hpp"
#include "import/import_caret.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

class Paths {
 public:
  explicit Paths(const Graph& graph) : graph_(graph), tasks_(make_tasks(graph)) {}

  /// Fills in the chain. Returns why the path is not a chain; empty: it is one.
  std::string follow(const CaretPath& path, Chain& chain) const {
    std::vector<TaskId> along;
    const auto append = [&](TaskId id) {
      if (std::ranges::count(along, id) == 0) along.push_back(id);
    };
    for (const CaretStep& step : path.steps) {
      const std::string node = graph_node_name(step.node);
      if (!step.subscribed.empty()) {
        const auto named = tasks_named(graph_, tasks_, node + "/" + graph_topic_name(step.subscribed));
        if (named.empty()) return program::concat("node ", node, " does not subscribe to ", step.subscribed);
        append(named.front());
      }
      if (step.published.empty()) continue;
      const auto publisher = publisher_of(node, graph_topic_name(step.published));
      if (!publisher) return program::concat("no callback of ", node, " publishes ", step.published);
      append(*publisher);
    }
    if (along.empty()) return "it names no topic";
    // A callback that only stores its sample cannot end a chain; the user of the sample does.
    if (tasks_.callbacks[along.back()].stores_only) append(tasks_.downstream(along.back()).front());
    for (std::size_t i = 1; i < along.size(); ++i) {
      const std::vector<TaskId> next = tasks_.downstream(along[i - 1]);
      if (std::ranges::count(next, along[i]) == 0) {
        return program::concat("data of ", name(along[i - 1]), " does not reach the messages of ",
                               name(along[i]));
      }
    }
    for (const TaskId id : along) chain.nodes.push_back(name(id));
    chain.sources = {chain.nodes.front()};
    chain.sink = chain.nodes.back();
    return "";
  }

 private:
  const std::string& name(TaskId id) const { return tasks_.set[id].name; }

  std::optional<TaskId> publisher_of(const std::string& node, const std::string& topic) const {
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      if (graph_.nodes[tasks_.origin[id].node].name != node) continue;
      if (std::ranges::count(tasks_.callbacks[id].publishes, topic, &Publication::topic) > 0) return id;
    }
    return std::nullopt;
  }

  const Graph& graph_;
  const GraphTasks tasks_;
};

}  // namespace

void add_chains(const CaretArchitecture& architecture, ImportedGraph& imported) {
  const Paths paths(imported.graph);
  std::vector<Chain> chains;
  for (const CaretPath& path : architecture.paths) {
    Chain chain;
    chain.name = graph_node_name(path.name);
    if (const std::string broken = paths.follow(path, chain); !broken.empty()) {
      imported.missing.push_back(program::concat("path ", path.name, " is not a chain: ", broken, "."));
    } else {
      chains.push_back(std::move(chain));
    }
  }
  imported.graph.chains = std::move(chains);
}

}  // namespace hotpath::imports
