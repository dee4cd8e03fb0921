// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/ros_names.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "hotpath/core/suggestion.hpp"
#include "hotpath/core/utf8.hpp"

namespace hotpath {

std::string graph_topic_name(const std::string& ros_name) {
  std::string name = printable(ros_name.starts_with('/') ? ros_name.substr(1) : ros_name);
  std::ranges::replace_if(
      name, [](char c) { return std::string_view(" \\,\"'`").find(c) != std::string_view::npos; }, '_');
  return name;
}

std::string graph_node_name(const std::string& ros_name) {
  std::string name = graph_topic_name(ros_name);
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

const Node* find_ros_node(const Graph& graph, const std::string& ros_name) {
  const std::string name = graph_node_name(ros_name);
  if (const auto found = std::ranges::find(graph.nodes, name, &Node::name); found != graph.nodes.end()) {
    return &*found;
  }
  const std::string bare = name.substr(name.rfind('.') + 1);
  const Node* only = nullptr;
  for (const Node& node : graph.nodes) {
    if (node.name == bare) only = &node;
    if (node.name.ends_with("." + bare)) return nullptr;
  }
  return only;
}

std::string no_such_nodes(const Graph& graph, std::span<const std::string> ros_names) {
  const std::vector<std::string> known = graph.node_names();
  const auto alike = [&](const std::string& name) {
    return nearest(graph_node_name(name), known).has_value();
  };
  const auto similar = std::ranges::find_if(ros_names, alike);
  const std::string& name = similar == ros_names.end() ? ros_names.front() : *similar;
  return "graph " + graph.name + " has no node of this executor so far, so that none inherits a priority; " +
         name + ": " + suggest(graph_node_name(name), known);
}

}  // namespace hotpath
