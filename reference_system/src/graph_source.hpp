// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// History depth of an input that is given none (upstream's nodes/settings.hpp).
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
  int line = 0;
};

/// A graph with the lines of its file that its parts come from.
struct GraphSource {
  std::string file;
  Graph graph;
  std::vector<NodeLines> nodes;            ///< Parallel to graph.nodes.
  std::vector<ChainLines> chains;          ///< Parallel to graph.chains.
  std::map<std::string, TopicRule> rules;  ///< The file's `topics`.
};

/// From YAML text; checks each part on its own. Throws InputError.
GraphSource parse_graph(const std::string& file, const std::string& text);

/// Checks how the parts fit together. Throws InputError.
void check_graph(const GraphSource& source);

}  // namespace hotpath
