// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/deployment.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "hotpath/core/priority_order.hpp"

namespace hotpath {

namespace {

constexpr int kHighestPriority = 98;

Deployment single(const Graph& graph, const GraphTasks& tasks) {
  Deployment d;
  d.executors.push_back({graph.name, "default", {}, {}, 0});
  d.executor_of.assign(tasks.set.size(), 0);
  return d;
}

Deployment isolated(const Graph& graph, const GraphTasks& tasks) {
  Deployment d;
  for (const Node& node : graph.nodes) d.executors.push_back({node.name, "default", {}, {}, 0});
  for (const TaskOrigin& origin : tasks.origin) d.executor_of.push_back(origin.node);
  return d;
}

/// One executor per callback group; the executor of a reentrant group has four threads (tier4's
/// callback_isolated_executor).
Deployment callback_isolated(const Graph& graph, const GraphTasks& tasks) {
  Deployment d;
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> executor_of_group(tasks.set.groups.size(), kNone);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    std::uint32_t& executor = executor_of_group[tasks.set[id].group];
    if (executor == kNone) {
      executor = static_cast<std::uint32_t>(d.executors.size());
      const bool reentrant = tasks.set.groups[tasks.set[id].group] == CallbackGroup::reentrant;
      const std::string& node = graph.nodes[tasks.origin[id].node].name;
      d.executors.push_back({node + "@" + tasks.set[id].name, reentrant ? "multi:4" : "default", {}, {}, 0});
    }
    d.executor_of.push_back(executor);
  }
  return d;
}

Deployment rate_monotonic_threads(const Graph&, const GraphTasks& tasks) {
  Deployment d;
  const std::vector<std::int64_t> level = inherited_levels(tasks.set, Policy::rm);
  const std::set<std::int64_t> levels(level.begin(), level.end());
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const auto slower = std::distance(levels.upper_bound(level[id]), levels.end());
    const int priority = 1 + std::min(kHighestPriority, static_cast<int>(slower));
    d.executors.push_back({tasks.set[id].name, "default", {ThreadPolicy::Class::fifo, priority}, {}, 0});
    d.executor_of.push_back(id);
  }
  return d;
}

constexpr std::array kPresets = {
    DeploymentPreset{"single", "one default executor for all nodes", single},
    DeploymentPreset{"isolated", "a default executor with its own thread for each node", isolated},
    DeploymentPreset{"cie", "CallbackIsolatedExecutor: a default executor for each callback group",
                     callback_isolated},
    DeploymentPreset{"rm-threads", "a SCHED_FIFO thread for each task, rate monotonic: fully preemptive",
                     rate_monotonic_threads},
};

}  // namespace

std::vector<std::size_t> Deployment::executors_in(std::uint32_t process) const {
  std::vector<std::size_t> indices;
  for (std::size_t e = 0; e < executors.size(); ++e) {
    if (executors[e].process == process) indices.push_back(e);
  }
  return indices;
}

std::vector<std::uint32_t> Deployment::process_of(const Graph& graph, const GraphTasks& tasks) const {
  std::vector<std::uint32_t> process(graph.nodes.size(), 0);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    process[tasks.origin[id].node] = executors[executor_of[id]].process;
  }
  return process;
}

std::span<const DeploymentPreset> deployment_presets() { return kPresets; }

}  // namespace hotpath
