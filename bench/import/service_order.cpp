// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "import/recognition.hpp"

namespace hotpath::imports {

namespace {

/// Repeatedly takes the item that the remaining items precede least; of equals the first one.
/// `ahead(a, b)`: how much more the recording says for a before b than for b before a.
template <class Ahead>
std::vector<std::uint32_t> in_order(std::vector<std::uint32_t> left, Ahead&& ahead) {
  std::vector<std::uint32_t> order;
  while (!left.empty()) {
    const auto behind = [&](std::uint32_t item) {
      std::int64_t sum = 0;
      for (const std::uint32_t other : left)
        if (other != item) sum += std::max<std::int64_t>(0, ahead(other, item));
      return sum;
    };
    const auto first = std::ranges::min_element(left, {}, behind);
    order.push_back(*first);
    left.erase(first);
  }
  return order;
}

}  // namespace

ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                           const OrderEvidence& evidence) {
  const std::size_t nodes = system.nodes.size();
  std::vector<std::vector<std::int64_t>> of_nodes(nodes, std::vector<std::int64_t>(nodes, 0));
  const auto ahead = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
    const TaskId first = graph.task_of[a], second = graph.task_of[b];
    const auto found = evidence.find(std::minmax(first, second));
    return found == evidence.end() ? 0 : first < second ? found->second : -found->second;
  };
  for (const auto& [pair, value] : evidence) {
    const std::uint32_t a = system.callbacks[graph.callback_of[pair.first]].node;
    const std::uint32_t b = system.callbacks[graph.callback_of[pair.second]].node;
    of_nodes[a][b] += value;
    of_nodes[b][a] -= value;
  }
  std::vector<std::uint32_t> callbacks, all_nodes(nodes);
  std::iota(all_nodes.begin(), all_nodes.end(), 0U);
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c)
    if (graph.task_of[c] != kNoTask) callbacks.push_back(c);
  return {in_order(all_nodes, [&](std::uint32_t a, std::uint32_t b) { return of_nodes[a][b]; }),
          in_order(callbacks, [&](std::uint32_t a, std::uint32_t b) {
            return system.callbacks[a].node == system.callbacks[b].node ? ahead(a, b) : 0;
          })};
}

std::vector<TaskId> tasks_in(const ServiceOrder& order, const tracing::System& system,
                             const RecordedGraph& graph) {
  std::vector<TaskId> tasks;
  for (const std::uint32_t node : order.nodes)
    for (const std::uint32_t c : order.callbacks)
      if (system.callbacks[c].node == node) tasks.push_back(graph.task_of[c]);
  for (TaskId id = 0; id < graph.callback_of.size(); ++id)
    if (graph.callback_of[id] == kNone) tasks.push_back(id);
  return tasks;
}

}  // namespace hotpath::imports
