// SPDX-License-Identifier: Apache-2.0
#include "import/unmodelled.hpp"

#include <map>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// A rule that explains a smaller share of a node's jobs does not describe it.
constexpr double kDescribes = 0.95;

/// Callbacks of subscriptions are functions of this namespace.
constexpr const char* kSynchronisers = "message_filters";

}  // namespace

std::vector<std::string> unmodelled(const tracing::System& system, const RecordedGraph& graph) {
  std::map<std::uint32_t, std::vector<std::string>> filtered;  // topics by node
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c) {
    const tracing::Callback& callback = system.callbacks[c];
    const bool filters = callback.symbol.find(kSynchronisers) != std::string::npos;
    if (graph.task_of[c] != kNoTask && filters)
      filtered[callback.node].push_back(system.topics[callback.topic].name);
  }
  std::vector<std::string> all;
  all.reserve(filtered.size() + graph.rules.size());
  for (const auto& [node, topics] : filtered) {
    all.push_back(program::concat(
        "Node ", system.nodes[node], " passes ", program::joined(topics, ", "),
        " through message_filters, which is not modelled: a synchroniser may hold messages until "
        "later ones arrive, and the graph publishes as soon as its rule allows."));
  }
  for (const InferredRule& rule : graph.rules) {
    if (static_cast<double>(rule.explained) >= kDescribes * static_cast<double>(rule.jobs)) continue;
    all.push_back(program::concat(
        "No rule of publication describes topic ", system.topics[rule.topic].name, ": the best one explains ",
        rule.explained, " of ", rule.jobs, " jobs of ",
        system.nodes[system.callbacks[rule.publishers.front()].node],
        ". A lifecycle node publishes only while it is active; other nodes decide by content."));
  }
  return all;
}

}  // namespace hotpath::imports
