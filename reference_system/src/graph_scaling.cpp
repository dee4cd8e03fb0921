// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

/// Renames `Node`, `Node/topic`, or, for nodes of type callbacks, `Node/callback`, whose last part is not a
/// topic. `graph` has the old names.
void rename_task(std::string& name, const Graph& graph, const std::string& suffix) {
  const std::size_t slash = name.find('/');
  const Node* const node = graph.find(name);
  if (slash != std::string::npos && !(node != nullptr && node->type == NodeType::callbacks)) name += suffix;
  name.insert(std::min(slash, name.size()), suffix);
}

/// Adds a copy of the graph `one` with other names.
void add_copy(Graph& graph, const Graph& one, const std::string& suffix) {
  for (Node node : one.nodes) {
    for (Callback& callback : node.callbacks) {
      rename_task(callback.task, one, suffix);
      for (Publication& publication : callback.publishes) publication.topic += suffix;
    }
    node.name += suffix;
    if (node.name.size() > kMaxNameBytes)
      throw std::invalid_argument("the name " + node.name + " would have more than " +
                                  std::to_string(kMaxNameBytes) + " bytes");
    for (Input& input : node.inputs) input.topic += suffix;
    for (std::string& output : node.outputs) output += suffix;
    graph.nodes.push_back(std::move(node));
  }
  for (Chain chain : one.chains) {
    chain.name += suffix;
    for (std::string& name : chain.nodes) rename_task(name, one, suffix);
    for (std::string& name : chain.sources) rename_task(name, one, suffix);
    rename_task(chain.sink, one, suffix);
    graph.chains.push_back(std::move(chain));
  }
  for (const auto& [topic, order] : one.delivery)
    for (DeliveryOrder& copy = graph.delivery[topic + suffix]; const std::string& node : order.nodes)
      copy.nodes.push_back(node + suffix);
  for (const std::string& topic : one.intra_process) graph.intra_process.insert(topic + suffix);
}

std::set<std::string> names_of(const Graph& graph) {
  std::set<std::string> names;
  for (const Node& node : graph.nodes) {
    names.insert(node.name);
    names.insert(node.outputs.begin(), node.outputs.end());
    for (const Input& input : node.inputs) names.insert(input.topic);
  }
  for (const Chain& chain : graph.chains) names.insert(chain.name);
  return names;
}

/// What stands before the number of a copy, so that no name of a copy is one of the graph.
std::string separator(const Graph& graph, unsigned copies) {
  const std::set<std::string> names = names_of(graph);
  const auto meets = [&](const std::string& between) {
    return std::ranges::any_of(names, [&](const std::string& name) {
      for (unsigned n = 2; n <= copies; ++n) {
        if (names.contains(name + between + std::to_string(n))) return true;
      }
      return false;
    });
  };
  std::string between = "_";
  while (meets(between)) between += "copy_";
  return between;
}

}  // namespace

void scale_rates(Graph& graph, double percent) {
  const auto scale = [percent](Duration& d) {
    if (d == Duration::zero()) return;
    d = std::max(Duration(1), Duration(std::llround(static_cast<double>(d.count()) * 100 / percent)));
  };
  for (Node& node : graph.nodes) {
    for (Callback& timer : node.callbacks) {
      scale(timer.period);
      scale(timer.deadline);
      if (timer.release_jitter > Duration::zero())
        timer.release_jitter = std::min(timer.release_jitter, timer.period - Duration(1));
      if (timer.phase) scale(*timer.phase);
    }
  }
}

void make_copies(Graph& graph, unsigned copies) {
  const Graph one = graph;
  const std::string between = separator(one, copies);
  for (unsigned n = 2; n <= copies; ++n) add_copy(graph, one, between + std::to_string(n));
}

}  // namespace hotpath
