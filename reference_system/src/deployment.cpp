// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/deployment.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "graph_source.hpp"
#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

/// By callback group that has tasks: the first of them.
std::map<std::uint32_t, TaskId> tasks_of_groups(const GraphTasks& tasks) {
  std::map<std::uint32_t, TaskId> groups;
  for (TaskId id = 0; id < tasks.set.size(); ++id) groups.emplace(tasks.set[id].group, id);
  return groups;
}

/// The executors that `make` gives to tasks, those of one name as one, in the order of their first tasks.
Deployment executors_by_name(const GraphTasks& tasks, const auto& make) {
  Deployment d;
  std::map<std::string, std::uint32_t> numbers;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const DeployedExecutor executor = make(id);
    const auto [number, is_new] = numbers.emplace(executor.name, numbers.size());
    if (is_new) d.executors.push_back(executor);
    d.executor_of.push_back(number->second);
  }
  return d;
}

Deployment single(const Graph& graph, const GraphTasks& tasks) {
  return executors_by_name(tasks, [&](TaskId) { return DeployedExecutor{graph.name, "default", {}, {}}; });
}

Deployment isolated(const Graph& graph, const GraphTasks& tasks) {
  return executors_by_name(tasks, [&](TaskId id) {
    return DeployedExecutor{graph.nodes[tasks.origin[id].node].name, "default", {}, {}};
  });
}

/// One executor per callback group; the executor of a reentrant group has four
/// threads (tier4's callback_isolated_executor).
Deployment callback_isolated(const Graph& graph, const GraphTasks& tasks) {
  const std::map<std::uint32_t, TaskId> first = tasks_of_groups(tasks);
  return executors_by_name(tasks, [&](TaskId id) {
    const std::uint32_t group = tasks.set[id].group;
    const bool reentrant = tasks.set.groups[group] == CallbackGroup::reentrant;
    const std::string& node = graph.nodes[tasks.origin[id].node].name;
    return DeployedExecutor{
        node + "@" + tasks.set[first.at(group)].name, reentrant ? "multi:4" : "default", {}, {}};
  });
}

Deployment rate_monotonic_threads(const Graph&, const GraphTasks& tasks) {
  constexpr int kMostAboveTheLowest = 98;
  const std::vector<std::int64_t> level = inherited_levels(tasks.set, Policy::rm);
  const std::set<std::int64_t> levels(level.begin(), level.end());
  return executors_by_name(tasks, [&](TaskId id) {
    const auto slower = static_cast<int>(std::distance(levels.upper_bound(level[id]), levels.end()));
    const ThreadPolicy policy{ThreadPolicy::Class::fifo, 1 + std::min(kMostAboveTheLowest, slower)};
    return DeployedExecutor{tasks.set[id].name, "default", policy, {}};
  });
}

constexpr std::array kPresets = {
    DeploymentPreset{"single", "one default executor for all nodes", single},
    DeploymentPreset{"isolated", "a default executor with its own thread for each node", isolated},
    DeploymentPreset{"cie", "CallbackIsolatedExecutor: a default executor for each callback group",
                     callback_isolated},
    DeploymentPreset{"rm-threads", "a SCHED_FIFO thread for each task, rate monotonic: fully preemptive",
                     rate_monotonic_threads},
};

constexpr const char* kDeploymentRemedy =
    "a deployment is one YAML map that begins with `name: NAME` and lists `executors`";

/// Parses the file; keeps a pointer to `path`.
YamlMap read_deployment(const std::string& path) {
  YamlMap map(path, read_text_file(path), "the deployment", kDeploymentRemedy);
  map.check_keys({"name", "description", "executors"});
  return map;
}

std::string text_of(const YamlMap& map, const std::string& key, const std::string& otherwise) {
  const auto given = map.find(key);
  return given ? given->text() : otherwise;
}

/// Reads one file for one graph.
class DeploymentReader {
 public:
  DeploymentReader(const std::string& path, const Graph& graph, const GraphTasks& tasks)
      : graph_(graph), tasks_(tasks) {
    deployment_.file = path;
  }

  Deployment read() {
    const YamlMap map = read_deployment(deployment_.file);
    deployment_.name = map.require("name", "NAME").name();
    deployment_.description = text_of(map, "description", "");
    for (const YamlValue& executor :
         map.require("executors", "[{name: NAME, executor: default, owns: rest}]").list("an executor")) {
      read_executor(executor);
    }
    for (const auto& [group, id] : groups_) {
      if (owner_.emplace(group, rest_).first->second != kNobody) continue;
      throw InputError(deployment_.file, 1,
                       "no executor owns all callback groups of node " + node_of(id).name,
                       "name the node, or give one executor `owns: rest`");
    }
    for (const Task& task : tasks_.set.tasks) deployment_.executor_of.push_back(owner_[task.group]);
    check_processes();
    for (TaskId publisher = 0; publisher < tasks_.set.size(); ++publisher)
      for (const TaskId reader : tasks_.set[publisher].feeds) check_intra_process(publisher, reader);
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
    executor.executor = text_of(map, "executor", "default");
    if (const auto given = map.find("policy")) {
      try {
        executor.policy = parse_thread_policy(given->text());
      } catch (const std::invalid_argument& error) {
        given->fail(error.what(), "see docs/deployments.md");
      }
    }
    if (const auto given = map.find("processors"))
      executor.processors = read_processors(*given, "a processor of " + executor.name);
    check_affinity(executor, deployment_.file);
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
        const auto [owner, is_new] = owner_.emplace(group, index);
        if (is_new) continue;
        const bool same = owner->second == index;
        item.fail("callback groups of " + item.text() + " belong to executor " +
                      (same ? executor : deployment_.executors[owner->second].name) + " already",
                  "remove them from one of the two");
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
    for (const auto& [group, id] : groups_)
      if (&node_of(id) == node && (name == text || tasks_.callbacks[id].group == wanted))
        found.push_back(group);
    return found;
  }

  const Node& node_of(TaskId id) const { return graph_.nodes[tasks_.origin[id].node]; }

  void check_one_process(TaskId a, TaskId b, const std::string& begin, const char* between,
                         const std::string& end, const std::string& remedy) const {
    const auto executor_of = [&](TaskId id) -> const DeployedExecutor& {
      return deployment_.executors[deployment_.executor_of[id]];
    };
    const DeployedExecutor &first = executor_of(a), &other = executor_of(b);
    if (first.process != other.process)
      throw InputError(deployment_.file, std::max(first.line, other.line),
                       begin + first.name + between + other.name + end,
                       "give both executors the same process" + remedy);
  }

  void check_processes() const {
    std::map<std::uint32_t, TaskId> first;  // by node
    for (const auto& [group, id] : groups_)
      check_one_process(first.emplace(tasks_.origin[id].node, id).first->second, id,
                        "node " + node_of(id).name + " would run in two processes, with executors ", " and ",
                        "", "");
  }

  void check_intra_process(TaskId publisher, TaskId reader) const {
    const std::string& topic = node_of(reader).inputs[*tasks_.origin[reader].input].topic;
    if (graph_.intra_process.contains(topic) || tasks_.set[reader].entity == EntityKind::intra_process)
      check_one_process(publisher, reader,
                        "topic " + topic + " is `intra_process`, and would lead from executor ", " to ",
                        " of another process", ", or take `intra_process` out of the graph");
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::map<std::uint32_t, TaskId> groups_ = tasks_of_groups(tasks_);
  std::map<std::uint32_t, std::uint32_t> owner_;  // by callback group
  std::uint32_t rest_ = kNobody;
  Deployment deployment_;
};

/// The value of each executor's `owns`; std::nullopt: `rest`, because it owns
/// an unnamed group. Throws std::invalid_argument if there are several of
/// these, or a group has several owners.
std::vector<std::optional<std::vector<std::string>>> owned(const Graph& graph, const GraphTasks& tasks,
                                                           const Deployment& deployment) {
  const std::map<std::uint32_t, TaskId> groups = tasks_of_groups(tasks);
  std::vector<std::set<std::uint32_t>> owners(graph.nodes.size());
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const std::uint32_t executor = deployment.executor_of[id];
    owners[tasks.origin[id].node].insert(executor);
    if (deployment.executor_of[groups.at(tasks.set[id].group)] != executor)
      throw std::invalid_argument("callbacks of one group belong to several executors");
  }
  std::vector<std::optional<std::vector<std::string>>> names(deployment.executors.size(),
                                                             std::vector<std::string>());
  std::set<std::uint32_t> rest;
  if (names.size() == 1) rest.insert(0);
  for (const auto& [group, id] : groups) {
    const Node& node = graph.nodes[tasks.origin[id].node];
    const std::uint32_t owner = deployment.executor_of[id], place = tasks.callbacks[id].group;
    const bool whole = owners[tasks.origin[id].node].size() == 1;
    std::vector<std::string>& own = *names[owner];
    if (!whole && place >= node.group_names.size())
      rest.insert(owner);
    else if (!whole)
      own.push_back(node.name + "/" + node.group_names[place]);
    else if (own.empty() || own.back() != node.name)
      own.push_back(node.name);
  }
  if (rest.size() > 1)
    throw std::invalid_argument("callback groups without a name belong to several executors");
  for (const std::uint32_t executor : rest) names[executor].reset();
  return names;
}

std::map<std::string, std::filesystem::path> deployment_files() {
  return yaml_files("HOTPATH_DEPLOYMENTS", HOTPATH_DEPLOYMENT_DIRS);
}

}  // namespace

std::vector<std::uint32_t> Deployment::process_of(const Graph& graph, const GraphTasks& tasks) const {
  std::vector<std::uint32_t> process(graph.nodes.size(), 0);
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    process[tasks.origin[id].node] = executors[executor_of[id]].process;
  return process;
}

std::span<const DeploymentPreset> deployment_presets() { return kPresets; }

std::vector<int> read_processors(const YamlValue& list, const std::string& item) {
  std::vector<int> all;
  for (const YamlValue& processor : list.list(item)) {
    const int number = static_cast<int>(processor.integer(0, kMaxProcessor));
    if (std::ranges::count(all, number) > 0)
      processor.fail("processor " + std::to_string(number) + " occurs twice", "name it once");
    all.push_back(number);
  }
  return all;
}

void check_affinity(const DeployedExecutor& executor, const std::string& file) {
  const bool deadline = executor.policy.scheduling_class == ThreadPolicy::Class::deadline;
  if (!deadline || executor.processors.empty()) return;
  throw InputError(file, executor.line,
                   "executor " + executor.name + ": Linux cannot pin SCHED_DEADLINE threads to processors",
                   "remove `processors` or `policy`");
}

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

std::vector<FileListing> list_deployment_files() {
  std::map<std::string, std::filesystem::path> files = deployment_files();
  for (const DeploymentPreset& preset : deployment_presets()) files.erase(std::string(preset.name));
  return list_files(files, [](FileListing& listing) {
    listing.description = text_of(read_deployment(listing.path), "description", "");
  });
}

}  // namespace hotpath
