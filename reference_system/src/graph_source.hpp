// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

class YamlValue;

/// Default history depth of an input (upstream's nodes/settings.hpp).
inline std::uint32_t default_depth(NodeType type) { return type == NodeType::command ? 10 : 1; }

struct NodeLines {
  int node = 0;
  std::vector<int> inputs, outputs;
};

struct ChainLines {
  int chain = 0;
  std::vector<int> nodes, sources;
  int sink = 0;
};

struct TopicRule {
  bool many_publishers = false;
  int line = 0, delivery_line = 0;
};

/// A graph with the line numbers of its parts in the file.
struct GraphSource {
  std::string file;  ///< Its name in messages.
  std::filesystem::path folder;
  Graph graph;
  std::vector<NodeLines> nodes;            ///< Parallel to graph.nodes.
  std::vector<ChainLines> chains;          ///< Parallel to graph.chains.
  std::map<std::string, TopicRule> rules;  ///< The file's `topics`.
};

/// Adds a node of any type. Throws InputError.
void read_node(const YamlValue& value, GraphSource& source);

/// Checks the consistency of the parts, and gives chains without sources or sink those of their ends. Throws
/// InputError.
void check_graph(GraphSource& source);

}  // namespace hotpath
