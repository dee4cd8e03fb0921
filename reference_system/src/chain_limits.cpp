// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_limits.hpp"

#include <algorithm>
#include <functional>
#include <map>

#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

ChainLimits chain_limits(const Graph& graph, const Chain& chain) {
  const GraphTasks tasks = make_tasks(graph);
  std::vector<std::vector<TaskId>> members;
  std::vector<Duration> work;
  std::size_t sink = 0;
  for (const std::string& name : chain.nodes) {
    if (name == chain.sink) sink = members.size();
    members.push_back(tasks_named(graph, tasks, name));
    Duration& most = work.emplace_back();
    for (const TaskId id : members.back()) most = std::max(most, tasks.set[id].wcet);
  }
  const auto leads_to = [&](std::size_t from, std::size_t to) {
    return std::any_of(members[from].begin(), members[from].end(), [&](TaskId id) {
      const std::vector<TaskId> next = tasks.downstream(id);
      return std::find_first_of(next.begin(), next.end(), members[to].begin(), members[to].end()) !=
             next.end();
    });
  };
  // A chain has no cycle: a node's longest branch is its own work plus that of its longest
  // predecessor.
  std::map<std::size_t, Duration> longest;
  const std::function<Duration(std::size_t)> finish = [&](std::size_t node) {
    if (const auto known = longest.find(node); known != longest.end()) return known->second;
    longest[node] = Duration::zero();  // a source's own inputs are not part of the chain
    Duration start{};
    if (std::find(chain.sources.begin(), chain.sources.end(), chain.nodes[node]) == chain.sources.end()) {
      for (std::size_t before = 0; before < members.size(); ++before) {
        if (before != node && leads_to(before, node)) start = std::max(start, finish(before));
      }
    }
    return longest[node] = start + work[node];
  };

  ChainLimits limits;
  limits.one_core_per_branch = finish(sink) - work[sink];
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (i != sink) limits.one_thread += work[i];
  }
  return limits;
}

}  // namespace hotpath
