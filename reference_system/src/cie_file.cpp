// SPDX-License-Identifier: Apache-2.0
// The configuration of tier4's callback_isolated_executor (cie_thread_configurator/README.md).
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>

#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

using Class = ThreadPolicy::Class;

/// The executor's names of policies, in the order of ThreadPolicy::Class.
std::vector<std::string> policies() {
  std::vector<std::string> names = words<Class>();
  for (std::string& name : names) {
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    name.insert(0, "SCHED_");
  }
  return names;
}

std::string absolute(const std::string& name) { return name.starts_with('/') ? name : "/" + name; }

/// Lists the callbacks of a group like rclcpp: first its subscriptions, then its timers.
std::string id_of_group(const Graph& graph, const GraphTasks& tasks, std::uint32_t group) {
  std::string node, subscriptions, timers;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].group != group) continue;
    const TaskOrigin& origin = tasks.origin[id];
    const Node& owner = graph.nodes[origin.node];
    node = absolute(owner.name);
    if (origin.input) {
      subscriptions += "@Subscription(" + absolute(owner.inputs[*origin.input].topic) + ")";
    } else {
      timers += "@Timer(" + std::to_string(tasks.set[id].period.count()) + ")";
    }
  }
  return node + subscriptions + timers;
}

/// Removes the entities that this program's nodes do not have.
std::string comparable(const std::string& id) {
  std::string kept;
  for (std::size_t at = 0; at <= id.size();) {
    const std::size_t end = std::min(id.find('@', at), id.size());
    const std::string part = id.substr(at, end - at);
    const bool foreign = part == "Waitable" || part.starts_with("Service(") || part.starts_with("Client(") ||
                         part == "Subscription(/parameter_events)";
    if (at == 0 || !foreign) kept += (at == 0 ? "" : "@") + part;
    at = end + 1;
  }
  return kept;
}

using ExecutorsOf = std::map<std::string, std::set<std::uint32_t>>;  // by id

/// Empty for a group that only has services.
std::set<std::uint32_t> executors_of(const YamlValue& id, const ExecutorsOf& all, const Graph& graph) {
  const std::string wanted = comparable(id.text());
  if (const auto entry = all.find(wanted); entry != all.end()) return entry->second;
  std::vector<std::string> known;
  for (const auto& [of_group, executors] : all) known.push_back(of_group);
  const bool without_callbacks = wanted.find('@') == std::string::npos && wanted != id.text();
  if (without_callbacks &&
      std::ranges::any_of(graph.nodes, [&](const Node& n) { return absolute(n.name) == wanted; })) {
    return {};
  }
  id.fail("graph " + graph.name + " has no callback group " + wanted, suggest(wanted, known));
}

ThreadPolicy read_policy(const YamlMap& map) {
  const YamlValue given = map.require("policy", "SCHED_OTHER");
  ThreadPolicy policy{static_cast<Class>(given.choice(policies()))};
  if (policy.scheduling_class == Class::deadline) {
    for (const auto& [key, part] :
         {std::pair{"runtime", &ThreadPolicy::runtime}, std::pair{"deadline", &ThreadPolicy::deadline},
          std::pair{"period", &ThreadPolicy::period}}) {
      policy.*part = Duration(map.require(key, "NANOSECONDS").integer(1, std::int64_t{1} << 60));
    }
    try {
      check_budget(policy);
    } catch (const std::invalid_argument& error) {
      map.fail(error.what(), "give all three in nanoseconds");
    }
  } else if (policy.ordinary()) {
    // Older versions call the nice value `priority`.
    const auto nice = map.find("nice") ? map.find("nice") : map.find("priority");
    if (nice) policy.priority = static_cast<int>(nice->integer(-20, 19));
  } else {
    policy.priority = static_cast<int>(map.require("priority", "50").integer(1, kHighestPriority));
  }
  return policy;
}

void write_threads(std::ostream& out, const DeployedExecutor& executor) {
  out << "    affinity:";
  for (const int processor : executor.processors) out << "\n      - " << processor;
  const ThreadPolicy& policy = executor.policy;
  const std::string word = policies()[static_cast<std::size_t>(policy.scheduling_class)];
  out << (executor.processors.empty() ? " ~" : "") << "\n    policy: " << word << "\n";
  if (policy.scheduling_class == Class::deadline) {
    out << "    runtime: " << policy.runtime.count() << "\n    deadline: " << policy.deadline.count()
        << "\n    period: " << policy.period.count() << "\n";
  } else {
    out << (policy.ordinary() ? "    nice: " : "    priority: ") << policy.priority << "\n";
  }
}

}  // namespace

Deployment read_cie(const std::string& path, const Graph& graph, const GraphTasks& tasks) {
  Deployment deployment = find_deployment("cie", graph, tasks);
  deployment.file = path;
  deployment.name = "cie:" + std::filesystem::path(path).stem().string();
  ExecutorsOf all;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    all[id_of_group(graph, tasks, tasks.set[id].group)].insert(deployment.executor_of[id]);
  }
  const YamlMap file(path, read_text_file(path), "the file",
                     "the file lists `callback_groups`, each with `id` and `policy`");
  file.check_keys({"callback_groups", "non_ros_threads", "hardware_info", "rt_throttling"});
  std::set<std::string> ids;
  for (const YamlValue& group :
       file.require("callback_groups", "[{id: /NODE@Timer(100000000), policy: SCHED_OTHER}]")
           .list("a callback group")) {
    YamlMap map(group, "a callback group");
    const YamlValue id = map.require("id", "/NODE@Timer(100000000)");
    const std::string text = id.text();
    map.set_what("callback group " + text);
    map.check_keys(
        {"id", "domain_id", "affinity", "policy", "priority", "nice", "runtime", "deadline", "period"});
    if (!ids.insert(text).second) id.fail("callback group " + text + " occurs twice", "keep one");
    DeployedExecutor threads{text, "", read_policy(map), {}, map.line()};
    if (const auto given = map.find("affinity"); given && !given->is_null())
      threads.processors = read_processors(*given, "a processor of " + map.what());
    check_affinity(threads, path);
    for (const std::uint32_t e : executors_of(id, all, graph)) {
      DeployedExecutor& executor = deployment.executors[e];
      executor.policy = threads.policy;
      executor.processors = threads.processors;
      executor.line = threads.line;
    }
  }
  return deployment;
}

void write_cie(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment) {
  std::map<std::uint32_t, std::uint32_t> executor_of_group, group_of_executor;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const std::uint32_t executor = deployment.executor_of[id], group = tasks.set[id].group;
    if (executor_of_group.emplace(group, executor).first->second != executor ||
        group_of_executor.emplace(executor, group).first->second != group) {
      throw std::invalid_argument(
          "deployment " + deployment.name + ": executor " + deployment.executors[executor].name +
          " does not serve exactly one callback group, as CallbackIsolatedExecutor requires");
    }
  }
  out << "callback_groups:\n";
  for (const auto& [group, executor] : executor_of_group) {
    out << "  - id: " << id_of_group(graph, tasks, group) << "\n";
    write_threads(out, deployment.executors[executor]);
  }
}

}  // namespace hotpath
