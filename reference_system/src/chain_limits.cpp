// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_limits.hpp"

#include <algorithm>
#include <functional>
#include <map>

namespace hotpath {

ChainLimits chain_limits(const Graph& graph, const Chain& chain) {
  const auto in_chain = [&](const std::string& node) {
    return std::find(chain.nodes.begin(), chain.nodes.end(), node) != chain.nodes.end();
  };
  // A chain has no cycle: a node's longest branch is its own work and that of its longest predecessor.
  std::map<std::string, Duration> longest;
  const std::function<Duration(const std::string&)> finish = [&](const std::string& name) {
    if (const auto known = longest.find(name); known != longest.end()) return known->second;
    const Node& node = *graph.find(name);
    longest[name] = Duration::zero();  // a source's own inputs are not part of the chain
    Duration start{};
    if (std::find(chain.sources.begin(), chain.sources.end(), name) == chain.sources.end()) {
      for (const Node& before : graph.nodes) {
        if (!in_chain(before.name)) continue;
        for (const std::string& topic : before.outputs) {
          const bool feeds = std::any_of(node.inputs.begin(), node.inputs.end(),
                                         [&](const Input& input) { return input.topic == topic; });
          if (feeds) start = std::max(start, finish(before.name));
        }
      }
    }
    return longest[name] = start + node.execution_time;
  };

  ChainLimits limits;
  limits.one_core_per_branch = finish(chain.sink) - graph.find(chain.sink)->execution_time;
  for (const std::string& name : chain.nodes) {
    if (name != chain.sink) limits.one_thread += graph.find(name)->execution_time;
  }
  return limits;
}

}  // namespace hotpath
