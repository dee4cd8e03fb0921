// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <set>
#include <stdexcept>

#include "hotpath/reference_system/deployment.hpp"
#include "yaml_writer.hpp"

namespace hotpath {

namespace {

class Owners {
 public:
  Owners(const Graph& graph, const GraphTasks& tasks, const Deployment& deployment)
      : graph_(graph), owners_(graph.nodes.size()) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const auto [owner, is_new] =
          owners_[tasks.origin[id].node].emplace(tasks.callbacks[id].group, deployment.executor_of[id]);
      if (is_new || owner->second == deployment.executor_of[id]) continue;
      throw std::invalid_argument("callbacks of one group belong to several executors");
    }
  }

  /// Writes the value of an executor's `owns`; `rest` if it owns an unnamed group.
  void write(YAML::Emitter& out, std::uint32_t executor, bool alone) {
    std::vector<std::string> owned;
    bool rest = alone;
    for (std::size_t n = 0; n < owners_.size(); ++n) {
      const Node& node = graph_.nodes[n];
      std::set<std::uint32_t> of_node;
      for (const auto& [group, owner] : owners_[n]) of_node.insert(owner);
      if (!of_node.contains(executor)) continue;
      if (of_node.size() == 1) {
        owned.push_back(node.name);
        continue;
      }
      for (const auto& [group, owner] : owners_[n]) {
        if (owner != executor) continue;
        const bool named = group < node.group_names.size();
        if (named) owned.push_back(node.name + "/" + node.group_names[group]);
        rest = rest || !named;
      }
    }
    if (rest && std::exchange(rest_, true)) {
      throw std::invalid_argument("callback groups without a name belong to several executors");
    }
    rest ? out << "rest" : out << YAML::Flow << owned;
  }

 private:
  const Graph& graph_;
  std::vector<std::map<std::uint32_t, std::uint32_t>> owners_;  // by node and group
  bool rest_ = false;
};

}  // namespace

std::string deployment_yaml(const Graph& graph, const GraphTasks& tasks, const Deployment& deployment) {
  Owners owners(graph, tasks, deployment);
  YamlWriter file;
  file.out << YAML::BeginMap;
  file.pair("name", deployment.name);
  if (!deployment.description.empty()) file.pair("description", deployment.description);
  file.key("executors") << YAML::BeginSeq;
  for (std::uint32_t e = 0; e < deployment.executors.size(); ++e) {
    const DeployedExecutor& executor = deployment.executors[e];
    file.out << YAML::Flow << YAML::BeginMap;
    file.pair("name", executor.name);
    file.pair("executor", executor.executor);
    if (executor.policy != ThreadPolicy{}) file.pair("policy", to_string(executor.policy));
    if (!executor.processors.empty()) file.key("processors") << executor.processors;
    const std::string& process = deployment.processes[executor.process];
    if (!process.empty()) file.pair("process", process);
    owners.write(file.key("owns"), e, deployment.executors.size() == 1);
    file.out << YAML::EndMap;
  }
  file.out << YAML::EndSeq << YAML::EndMap << YAML::Newline;
  return file.out.c_str();
}

}  // namespace hotpath
