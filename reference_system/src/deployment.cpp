// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/deployment.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "hotpath/core/priority_order.hpp"

namespace hotpath {

namespace {

/// An executor for each value of `key`, in the order of their first tasks; `make` gives its name, kind and
/// policy.
Deployment executor_for_each(const GraphTasks& tasks, const auto& key, const auto& make) {
  Deployment d;
  std::map<std::uint32_t, std::uint32_t> executor_of;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const auto number = static_cast<std::uint32_t>(d.executors.size());
    const auto [executor, is_new] = executor_of.emplace(key(id), number);
    if (is_new) d.executors.push_back(make(id));
    d.executor_of.push_back(executor->second);
  }
  return d;
}

Deployment single(const Graph& graph, const GraphTasks& tasks) {
  return executor_for_each(
      tasks, [](TaskId) { return 0U; },
      [&](TaskId) {
        return DeployedExecutor{graph.name, "default", {}, {}};
      });
}

Deployment isolated(const Graph& graph, const GraphTasks& tasks) {
  const auto node = [&](TaskId id) { return tasks.origin[id].node; };
  return executor_for_each(tasks, node, [&](TaskId id) {
    return DeployedExecutor{graph.nodes[node(id)].name, "default", {}, {}};
  });
}

/// One executor per callback group; the executor of a reentrant group has four threads (tier4's
/// callback_isolated_executor).
Deployment callback_isolated(const Graph& graph, const GraphTasks& tasks) {
  const auto group = [&](TaskId id) { return tasks.set[id].group; };
  return executor_for_each(tasks, group, [&](TaskId id) {
    const bool reentrant = tasks.set.groups[group(id)] == CallbackGroup::reentrant;
    return DeployedExecutor{graph.nodes[tasks.origin[id].node].name + "@" + tasks.set[id].name,
                            reentrant ? "multi:4" : "default",
                            {},
                            {}};
  });
}

Deployment rate_monotonic_threads(const Graph&, const GraphTasks& tasks) {
  constexpr int kMostAboveTheLowest = 98;
  const std::vector<std::int64_t> level = inherited_levels(tasks.set, Policy::rm);
  const std::set<std::int64_t> levels(level.begin(), level.end());
  const auto thread = [&](TaskId id) {
    const auto slower = static_cast<int>(std::distance(levels.upper_bound(level[id]), levels.end()));
    const ThreadPolicy policy{ThreadPolicy::Class::fifo, 1 + std::min(kMostAboveTheLowest, slower)};
    return DeployedExecutor{tasks.set[id].name, "default", policy, {}};
  };
  return executor_for_each(
      tasks, [](TaskId id) { return id; }, thread);
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
  for (std::size_t e = 0; e < executors.size(); ++e)
    if (executors[e].process == process) indices.push_back(e);
  return indices;
}

std::vector<std::uint32_t> Deployment::process_of(const Graph& graph, const GraphTasks& tasks) const {
  std::vector<std::uint32_t> process(graph.nodes.size(), 0);
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    process[tasks.origin[id].node] = executors[executor_of[id]].process;
  return process;
}

std::span<const DeploymentPreset> deployment_presets() { return kPresets; }

}  // namespace hotpath
