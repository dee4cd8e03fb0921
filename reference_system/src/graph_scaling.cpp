// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

/// A copy of a graph's parts with other names.
class Renamed {
 public:
  Renamed(const Graph& graph, std::string suffix) : graph_(graph), suffix_(std::move(suffix)) {}

  Node node(Node n) const {
    for (Callback& callback : n.callbacks) {
      callback.task = task(callback.task);
      for (Publication& publication : callback.publishes) publication.topic += suffix_;
    }
    n.name += suffix_;
    if (n.name.size() > kMaxNameBytes) {
      throw std::invalid_argument("the name " + n.name + " would have more than " +
                                  std::to_string(kMaxNameBytes) + " bytes");
    }
    for (Input& input : n.inputs) input.topic += suffix_;
    for (std::string& output : n.outputs) output += suffix_;
    return n;
  }

  std::pair<std::string, DeliveryOrder> delivery(std::pair<std::string, DeliveryOrder> of_topic) const {
    of_topic.first += suffix_;
    for (std::string& node : of_topic.second.nodes) node += suffix_;
    return of_topic;
  }

  [[nodiscard]] std::string topic(const std::string& name) const { return name + suffix_; }

  Chain chain(Chain c) const {
    c.name += suffix_;
    for (std::string& name : c.nodes) name = task(name);
    for (std::string& name : c.sources) name = task(name);
    c.sink = task(c.sink);
    return c;
  }

 private:
  /// Renames `Node`, `Node/topic`, or, for nodes of type callbacks, `Node/callback`, whose last
  /// part is not a topic.
  std::string task(const std::string& name) const {
    const std::size_t slash = name.find('/');
    if (slash == std::string::npos) return name + suffix_;
    const Node* const node = graph_.find(name.substr(0, slash));
    const bool callbacks = node != nullptr && node->type == NodeType::callbacks;
    return name.substr(0, slash) + suffix_ + name.substr(slash) + (callbacks ? "" : suffix_);
  }

  const Graph& graph_;
  const std::string suffix_;
};

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
  for (unsigned n = 2; n <= copies; ++n) {
    const Renamed renamed(one, between + std::to_string(n));
    for (const Node& node : one.nodes) graph.nodes.push_back(renamed.node(node));
    for (const Chain& chain : one.chains) graph.chains.push_back(renamed.chain(chain));
    for (const auto& order : one.delivery) graph.delivery.insert(renamed.delivery(order));
    for (const std::string& topic : one.intra_process) graph.intra_process.insert(renamed.topic(topic));
  }
}

}  // namespace hotpath
