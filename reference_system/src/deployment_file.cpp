// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "yaml_writer.hpp"

namespace hotpath {

void check_affinity(const DeployedExecutor& executor, const std::string& file) {
  const bool deadline = executor.policy.scheduling_class == ThreadPolicy::Class::deadline;
  if (!deadline || executor.processors.empty()) return;
  throw InputError(file, executor.line,
                   "executor " + executor.name + ": Linux cannot pin SCHED_DEADLINE threads to processors",
                   "remove `processors` or `policy`");
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kDeploymentRemedy =
    "a deployment is one YAML map that begins with `name: NAME` and lists `executors`";

/// Parses the file; keeps a pointer to `path`.
YamlMap read_deployment(const std::string& path) {
  YamlMap map(path, read_text_file(path), "the deployment", kDeploymentRemedy);
  map.check_keys({"name", "description", "executors"});
  return map;
}

std::string description_of(const YamlMap& map) {
  const auto given = map.find("description");
  return given ? given->text() : "";
}

/// By node: the callback groups of its callbacks, from the place among the node's groups to the number among
/// those of all tasks.
std::vector<std::map<std::uint32_t, std::uint32_t>> groups_of(const Graph& graph, const GraphTasks& tasks) {
  std::vector<std::map<std::uint32_t, std::uint32_t>> groups(graph.nodes.size());
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    groups[tasks.origin[id].node].emplace(tasks.callbacks[id].group, tasks.set[id].group);
  return groups;
}

/// Reads one file for one graph.
class DeploymentReader {
 public:
  DeploymentReader(const std::string& path, const Graph& graph, const GraphTasks& tasks)
      : path_(path),
        graph_(graph),
        tasks_(tasks),
        groups_(groups_of(graph, tasks)),
        owner_(tasks.set.groups.size(), kNobody) {
    deployment_.file = path;
  }

  Deployment read() {
    const YamlMap map = read_deployment(path_);
    deployment_.name = map.require("name", "NAME").name();
    deployment_.description = description_of(map);
    for (const YamlValue& executor :
         map.require("executors", "[{name: NAME, executor: default, owns: rest}]").list("an executor")) {
      read_executor(executor);
    }
    for (std::size_t n = 0; n < groups_.size(); ++n) give_rest(n);
    for (std::size_t n = 0; n < groups_.size(); ++n) check_process(n);
    for (TaskId publisher = 0; publisher < tasks_.set.size(); ++publisher)
      for (const TaskId reader : tasks_.set[publisher].feeds) check_intra_process(publisher, reader);
    for (const Task& task : tasks_.set.tasks) deployment_.executor_of.push_back(owner_[task.group]);
    return std::move(deployment_);
  }

 private:
  static constexpr std::uint32_t kNobody = ~0U;

  void read_executor(const YamlValue& value) {
    YamlMap map(value, "an executor");
    DeployedExecutor executor;
    executor.line = map.line();
    const YamlValue name = map.require("name", "NAME");
    executor.name = name.topic();
    if (std::ranges::count(deployment_.executors, executor.name, &DeployedExecutor::name) > 0)
      name.fail("executor " + executor.name + " occurs twice", "rename one");
    map.set_what("executor " + executor.name);
    map.check_keys({"name", "executor", "policy", "processors", "process", "owns"});
    const auto kind = map.find("executor");
    executor.executor = kind ? kind->text() : "default";
    if (const auto given = map.find("policy")) {
      try {
        executor.policy = parse_thread_policy(given->text());
      } catch (const std::invalid_argument& error) {
        given->fail(error.what(), "see docs/deployments.md");
      }
    }
    if (const auto given = map.find("processors")) {
      for (const YamlValue& processor : given->list("a processor of " + executor.name)) {
        const int number = static_cast<int>(processor.integer(0, kMaxProcessor));
        if (std::ranges::count(executor.processors, number) > 0)
          processor.fail("processor " + std::to_string(number) + " occurs twice", "name it once");
        executor.processors.push_back(number);
      }
    }
    check_affinity(executor, path_);
    executor.process = process(map.find("process"));
    own(map.require("owns", "[NODE] or rest"), executor.name);
    deployment_.executors.push_back(std::move(executor));
  }

  /// Numbers processes in the order of their first mention.
  std::uint32_t process(const std::optional<YamlValue>& given) {
    const std::string name = given ? given->long_name() : "";
    std::vector<std::string>& all = deployment_.processes;
    if (deployment_.executors.empty()) all = {name};
    const auto number = static_cast<std::uint32_t>(std::ranges::find(all, name) - all.begin());
    if (number == all.size()) all.push_back(name);
    return number;
  }

  void own(const YamlValue& value, const std::string& executor) {
    const auto index = static_cast<std::uint32_t>(deployment_.executors.size());
    if (value.is_text() && value.text() == "rest") {
      if (rest_ != kNobody) value.fail("two executors own the rest", "name the nodes of one of them");
      rest_ = index;
      return;
    }
    for (const YamlValue& item : value.list("a node of " + executor)) {
      for (const std::uint32_t group : groups(item)) {
        std::uint32_t& owner = owner_[group];
        if (owner != kNobody) {
          const std::string& first = owner == index ? executor : deployment_.executors[owner].name;
          item.fail("callback groups of " + item.text() + " belong to executor " + first + " already",
                    "remove them from one of the two");
        }
        owner = index;
      }
    }
  }

  /// The callback groups of `NODE` or `NODE/GROUP`; none for a group without callbacks.
  std::vector<std::uint32_t> groups(const YamlValue& item) const {
    const std::string text = item.text(), name = text.substr(0, text.find('/'));
    const Node* node = graph_.find(name);
    if (node == nullptr)
      item.fail("graph " + graph_.name + " has no node " + name, suggest(name, graph_.node_names()));
    std::ptrdiff_t wanted = -1;
    if (name != text) {
      const std::string group = text.substr(name.size() + 1);
      wanted = std::ranges::find(node->group_names, group) - node->group_names.begin();
      if (wanted == std::ssize(node->group_names))
        item.fail("node " + name + " has no callback group " + group, suggest(group, node->group_names));
    }
    std::vector<std::uint32_t> found;
    for (const auto& [place, group] : groups_[static_cast<std::size_t>(node - graph_.nodes.data())])
      if (name == text || place == wanted) found.push_back(group);
    return found;
  }

  void give_rest(std::size_t node) {
    for (const auto& [place, group] : groups_[node]) {
      if (owner_[group] == kNobody) owner_[group] = rest_;
      if (owner_[group] != kNobody) continue;
      throw InputError(path_, 1, "no executor owns all callback groups of node " + graph_.nodes[node].name,
                       "name the node, or give one executor `owns: rest`");
    }
  }

  const DeployedExecutor& owner_of(std::uint32_t group) const { return deployment_.executors[owner_[group]]; }

  void check_process(std::size_t node) const {
    for (const auto& [place, group] : groups_[node]) {
      const DeployedExecutor &first = owner_of(groups_[node].begin()->second), &other = owner_of(group);
      if (first.process == other.process) continue;
      throw InputError(path_, std::max(first.line, other.line),
                       "node " + graph_.nodes[node].name + " would run in two processes, with executors " +
                           first.name + " and " + other.name,
                       "give both executors the same process");
    }
  }

  void check_intra_process(TaskId publisher, TaskId reader) const {
    const Node& node = graph_.nodes[tasks_.origin[reader].node];
    const std::string& topic = node.inputs[*tasks_.origin[reader].input].topic;
    const DeployedExecutor &from = owner_of(tasks_.set[publisher].group),
                           &to = owner_of(tasks_.set[reader].group);
    const bool within =
        graph_.intra_process.contains(topic) || tasks_.set[reader].entity == EntityKind::intra_process;
    if (!within || from.process == to.process) return;
    throw InputError(path_, std::max(from.line, to.line),
                     "topic " + topic + " is `intra_process`, and would lead from executor " + from.name +
                         " to " + to.name + " of another process",
                     "give both executors the same process, or take `intra_process` out of the graph");
  }

  const std::string path_;
  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::vector<std::map<std::uint32_t, std::uint32_t>> groups_;
  std::vector<std::uint32_t> owner_;  // by callback group
  std::uint32_t rest_ = kNobody;
  Deployment deployment_;
};

/// The value of each executor's `owns`; std::nullopt: `rest`, because it owns an unnamed group. Throws
/// std::invalid_argument if there are several of these, or a group has several owners.
std::vector<std::optional<std::vector<std::string>>> owned(const Graph& graph, const GraphTasks& tasks,
                                                           const Deployment& deployment) {
  std::map<std::uint32_t, std::uint32_t> owner;  // by callback group
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const std::uint32_t executor = deployment.executor_of[id];
    if (owner.emplace(tasks.set[id].group, executor).first->second != executor)
      throw std::invalid_argument("callbacks of one group belong to several executors");
  }
  std::vector<std::optional<std::vector<std::string>>> names(deployment.executors.size());
  for (auto& of_executor : names) of_executor.emplace();
  std::set<std::uint32_t> rest;
  if (names.size() == 1) rest.insert(0);
  const auto groups = groups_of(graph, tasks);
  for (std::size_t n = 0; n < groups.size(); ++n) {
    const Node& node = graph.nodes[n];
    std::set<std::uint32_t> owners;
    for (const auto& [place, group] : groups[n]) owners.insert(owner.at(group));
    if (owners.size() == 1) names[*owners.begin()]->push_back(node.name);
    for (const auto& [place, group] : groups[n]) {
      if (owners.size() == 1) continue;
      const bool named = place < node.group_names.size();
      named ? names[owner.at(group)]->push_back(node.name + "/" + node.group_names[place])
            : void(rest.insert(owner.at(group)));
    }
  }
  if (rest.size() > 1)
    throw std::invalid_argument("callback groups without a name belong to several executors");
  for (const std::uint32_t executor : rest) names[executor].reset();
  return names;
}

std::map<std::string, fs::path> deployment_files() {
  return yaml_files("HOTPATH_DEPLOYMENTS", HOTPATH_DEPLOYMENT_DIRS);
}

}  // namespace

Deployment find_deployment(const std::string& name_or_path, const Graph& graph, const GraphTasks& tasks) {
  constexpr std::string_view kCie = "cie:";
  if (name_or_path.starts_with(kCie)) return read_cie(name_or_path.substr(kCie.size()), graph, tasks);
  for (const DeploymentPreset& preset : deployment_presets()) {
    if (preset.name != name_or_path) continue;
    Deployment d = preset.make(graph, tasks);
    d.name = preset.name;
    d.description = preset.description;
    return d;
  }
  std::vector<std::string> presets;
  for (const DeploymentPreset& preset : deployment_presets()) presets.emplace_back(preset.name);
  const std::string file = is_yaml_path(name_or_path)
                               ? name_or_path
                               : find_yaml("deployment", deployment_files(), name_or_path, presets);
  return DeploymentReader(file, graph, tasks).read();
}

std::string deployment_yaml(const Graph& graph, const GraphTasks& tasks, const Deployment& deployment) {
  const auto owns = owned(graph, tasks, deployment);
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
    owns[e] ? file.words("owns", *owns[e]) : file.pair("owns", "rest");
    file.out << YAML::EndMap;
  }
  file.out << YAML::EndSeq << YAML::EndMap << YAML::Newline;
  return file.out.c_str();
}

std::vector<DeploymentListing> list_deployment_files() {
  std::vector<DeploymentListing> listings;
  for (const auto& [name, path] : deployment_files()) {
    if (std::ranges::count(deployment_presets(), name, &DeploymentPreset::name) > 0) continue;
    DeploymentListing& listing = listings.emplace_back();
    listing.name = name;
    try {
      listing.description = description_of(read_deployment(path));
    } catch (const InputError& error) {
      listing.error = error.what();
    }
  }
  return listings;
}

}  // namespace hotpath
