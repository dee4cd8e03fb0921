// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hotpath/core/registry.hpp"
#include "import/import_caret.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Threads of a multi-threaded executor, whose number CARET does not record.
constexpr std::size_t kMostThreads = 4;
constexpr const char* kOthers = "external";

using Owners = std::map<std::string, std::uint32_t>;

DeployedExecutor executor_of(const CaretExecutor& caret) {
  DeployedExecutor executor;
  executor.name = graph_topic_name(caret.name);
  // More threads than groups would stay idle.
  const std::size_t threads = std::clamp<std::size_t>(caret.groups.size(), 2, kMostThreads);
  executor.executor = caret.multi_threaded ? program::concat("multi:", threads) : kBaselineExecutor;
  return executor;
}

/// Executors by task.
Owners owners_of_tasks(const CaretArchitecture& architecture,
                       const std::map<std::string, std::string>& task_of, const Owners& of_group) {
  Owners owners;
  for (const CaretNode& node : architecture.nodes) {
    for (const CaretGroup& group : node.groups) {
      const auto owner = of_group.find(group.name);
      if (owner == of_group.end()) continue;
      for (const std::string& callback : group.callbacks) {
        const auto task = task_of.find(callback);
        if (task != task_of.end()) owners[task->second] = owner->second;
      }
    }
  }
  return owners;
}

}  // namespace

Deployment deployment_of(const CaretArchitecture& architecture,
                         const std::map<std::string, std::string>& task_of, const GraphTasks& tasks) {
  Deployment deployment;
  deployment.description = "Executors recorded by CARET";
  std::vector<DeployedExecutor> all;
  Owners of_group;
  for (const CaretExecutor& caret : architecture.executors) {
    for (const std::string& group : caret.groups) of_group[group] = static_cast<std::uint32_t>(all.size());
    all.push_back(executor_of(caret));
  }
  if (of_group.empty()) return deployment;
  const auto others = static_cast<std::uint32_t>(all.size());
  all.emplace_back().name = kOthers;
  all.back().executor = kBaselineExecutor;
  const Owners owners = owners_of_tasks(architecture, task_of, of_group);
  std::map<std::uint32_t, std::uint32_t> index;  // of executors with tasks
  for (const Task& task : tasks.set.tasks) {
    const auto owner = owners.find(task.name);
    const std::uint32_t executor = owner == owners.end() ? others : owner->second;
    const auto [place, is_new] =
        index.emplace(executor, static_cast<std::uint32_t>(deployment.executors.size()));
    if (is_new) deployment.executors.push_back(all[executor]);
    deployment.executor_of.push_back(place->second);
  }
  return deployment;
}

}  // namespace hotpath::imports
