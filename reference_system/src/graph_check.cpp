// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <utility>

#include "graph_source.hpp"
#include "hotpath/core/suggestion.hpp"

namespace hotpath {

namespace {

void check_names(const GraphSource& source) {
  const std::vector<std::string> names = source.graph.node_names();
  for (std::size_t n = 0; n < names.size(); ++n) {
    const auto first = static_cast<std::size_t>(std::ranges::find(names, names[n]) - names.begin());
    if (first != n)
      throw InputError(source.file, source.nodes[n].node, "there are two nodes with the name " + names[n],
                       "rename this node or the node in line " + std::to_string(source.nodes[first].node));
  }
}

void check_publishers(const GraphSource& source, const std::set<std::string>& shared) {
  std::map<std::string, std::size_t> publisher;
  for (std::size_t n = 0; n < source.graph.nodes.size(); ++n) {
    const Node& node = source.graph.nodes[n];
    for (std::size_t o = 0; o < node.outputs.size(); ++o) {
      const std::string& topic = node.outputs[o];
      const auto [first, is_new] = publisher.emplace(topic, n);
      if (is_new || shared.contains(topic)) continue;
      throw InputError(source.file, source.nodes[n].outputs[o],
                       "node " + node.name + " publishes topic " + topic + ", as node " +
                           source.graph.nodes[first->second].name + " does (line " +
                           std::to_string(source.nodes[first->second].node) + ")",
                       "publish another topic, or allow several publishers with `topics: {" + topic +
                           ": {publishers: many}}`");
    }
  }
}

void check_inputs(const GraphSource& source) {
  const std::vector<std::string> topics = published_topics(source.graph);
  const std::set<std::string> published(topics.begin(), topics.end());
  for (std::size_t n = 0; n < source.graph.nodes.size(); ++n) {
    const Node& node = source.graph.nodes[n];
    std::set<std::string> seen;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      const std::string& topic = node.inputs[i].topic;
      const std::string subscription = "node " + node.name + " subscribes to topic " + topic;
      const auto fail = [&](const std::string& problem, const std::string& remedy) {
        throw InputError(source.file, source.nodes[n].inputs[i], subscription + problem, remedy);
      };
      if (!published.contains(topic)) {
        const auto best = nearest(topic, topics);
        fail(", which no node publishes",
             best ? "did you mean `" + *best + "`?" : "add a node with `output: " + topic + "`");
      }
      if (!seen.insert(topic).second) fail(" twice", "name each topic once among the inputs of a node");
    }
  }
}

void check_cycles(const GraphSource& source, const GraphTasks& tasks) {
  std::vector<TaskId> cycle = tasks.cycle();
  if (cycle.empty()) return;
  std::rotate(cycle.begin(), std::ranges::min_element(cycle), cycle.end());
  const auto name = [&](TaskId step) { return source.graph.nodes[tasks.origin[step].node].name; };
  std::string path;
  for (const TaskId step : cycle) path += name(step) + " -> ";
  const TaskOrigin& origin = tasks.origin[cycle.front()];
  throw InputError(source.file, source.nodes[origin.node].inputs[*origin.input],
                   "the nodes " + path + name(cycle.front()) + " form a cycle without a timer",
                   "cut it at a cyclic node, or take this input from another topic");
}

/// Bounds the entries of each message: its own entry, and those of all messages that its job merges.
void check_histories(const GraphSource& source, const GraphTasks& tasks) {
  const TaskId count = tasks.set.size();
  std::vector<std::set<std::uint32_t>> nodes(count);  // nodes that a message at this input can have visited
  std::vector<std::size_t> entries(count, 0);  // largest number of entries of one message at this input
  for (bool changed = true; std::exchange(changed, false);) {
    for (TaskId id = 0; id < count; ++id) {
      if (tasks.callbacks[id].publishes.empty()) continue;
      std::set<std::uint32_t> merged;
      std::size_t sum = 0;
      for (const TaskId input : tasks.merged_inputs(id)) {
        merged.insert(nodes[input].begin(), nodes[input].end());
        sum += entries[input];
      }
      // With several publishers of one topic, `merged` overestimates any one
      // message; with fusions of one origin, `sum` does.
      const std::size_t most = std::min(sum, merged.size()) + 1;
      const std::uint32_t own = tasks.origin[id].node;
      merged.insert(own);
      if (most > kMaxHistory)
        throw InputError(
            source.file, source.nodes[own].node,
            "messages of node " + source.graph.nodes[own].name + " carry the statistics of " +
                std::to_string(most) + " nodes or more",
            "a message has room for " + std::to_string(kMaxHistory) + ": shorten the graph before this node");
      for (const TaskId fed : tasks.set[id].feeds) {
        const std::size_t before = nodes[fed].size() + entries[fed];
        nodes[fed].insert(merged.begin(), merged.end());
        entries[fed] = std::max(entries[fed], most);
        changed = changed || nodes[fed].size() + entries[fed] != before;
      }
    }
  }
}

}  // namespace

std::vector<std::string> published_topics(const Graph& graph) {
  std::vector<std::string> topics;
  for (const Node& node : graph.nodes)
    for (const std::string& topic : node.outputs)
      if (std::ranges::count(topics, topic) == 0) topics.push_back(topic);
  return topics;
}

GraphTasks check_nodes(const GraphSource& source, const std::set<std::string>& shared) {
  check_names(source);
  check_publishers(source, shared);
  check_inputs(source);
  GraphTasks tasks = make_tasks(source.graph);
  check_cycles(source, tasks);
  if (!source.graph.has_callbacks()) check_histories(source, tasks);
  return tasks;
}

}  // namespace hotpath
