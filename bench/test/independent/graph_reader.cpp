// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "model.hpp"

namespace independent {

namespace {

Nanoseconds nanoseconds(const YAML::Node& ms) { return std::llround(ms.as<double>() * 1e6); }

std::vector<YAML::Node> items(const YAML::Node& node) {
  if (!node) return {};
  if (!node.IsSequence()) return {node};
  return {node.begin(), node.end()};
}

class Reader {
 public:
  Graph read(const std::string& file) {
    const YAML::Node root = YAML::LoadFile(file);
    if (root["service_wait_ms"]) graph_.service_wait = nanoseconds(root["service_wait_ms"]);
    graph_.until_iron = root["ros_distro"].as<std::string>("jazzy") < "jazzy";
    for (const YAML::Node& node : items(root["nodes"])) add_node(node);
    for (const auto& topic : root["topics"]) {
      if (!topic.second["intra_process"] || !topic.second["intra_process"].as<bool>()) continue;
      for (const int reader : readers_[topic.first.as<std::string>()]) {
        Task& task = graph_.tasks[static_cast<std::size_t>(reader)];
        if (task.guaranteed) continue;
        task.kind = "waitable";
        task.intra_process = true;
      }
    }
    for (Task& task : graph_.tasks) {
      for (Publication& publication : task.publications) publication.readers = readers_[publication.topic];
    }
    for (const YAML::Node& chain : items(root["chains"])) add_chain(chain);
    return graph_;
  }

 private:
  void add_node(const YAML::Node& node) {
    name_ = node["name"].as<std::string>();
    groups_.clear();
    sets_.clear();
    first_ = graph_.tasks.size();
    const auto type = node["type"].as<std::string>();
    const std::string output = node["output"] ? node["output"].as<std::string>() : name_;
    std::vector<YAML::Node> inputs = items(node["inputs"] ? node["inputs"] : node["input"]);
    if (type == "sensor") {
      timer(node, name_).publications = {{output}};
    } else if (type == "transform" || type == "command") {
      Task& task = subscription(inputs.at(0), node, type == "command" ? 10 : 1);
      if (type == "transform") task.publications = {{output}};
    } else if (type == "fusion") {
      const int set = slot_set(output, topics_of(inputs));
      for (const YAML::Node& input : inputs)
        subscription(input, node, 1).publications = {{output, Rule::all_new, 1, set}};
    } else if (type == "cyclic") {
      const int set = slot_set(output, topics_of(inputs));
      for (const YAML::Node& input : inputs) subscription(input, YAML::Node(), 1);
      timer(node, name_).publications = {{output, Rule::last_of, 1, set}};
    } else if (type == "intersection") {
      for (const YAML::Node& connection : items(node["connections"])) {
        subscription(connection["input"], node, 1).publications = {{connection["output"].as<std::string>()}};
      }
    } else if (type == "callbacks") {
      for (const YAML::Node& callback : items(node["callbacks"])) add_callback(callback, node["groups"]);
    } else {
      throw std::runtime_error(file_position(node) + "unknown type " + type);
    }
    for (std::size_t t = first_; t < graph_.tasks.size(); ++t) store(graph_.tasks[t]);
  }

  void add_callback(const YAML::Node& callback, const YAML::Node& groups) {
    Task& task = callback["timer"] ? timer(callback, name_ + "/" + callback["timer"].as<std::string>())
                                   : subscription(callback, callback, 1);
    task.node_in_chains = false;
    for (const char* const kind : {"service", "client", "waitable"}) {
      if (!callback[kind] || !callback[kind].as<bool>()) continue;
      task.kind = kind;
      task.guaranteed = true;
    }
    if (callback["group"]) {
      const auto name = callback["group"].as<std::string>();
      task.group = group(name);
      if (groups[name].as<std::string>() == "reentrant") graph_.reentrant.insert(task.group);
    }
    if (callback["priority"]) task.priority = callback["priority"].as<std::int64_t>();
    for (const YAML::Node& p : items(callback["publishes"])) {
      Publication publication{p.IsMap() ? p["topic"].as<std::string>() : p.as<std::string>()};
      if (p.IsMap() && p["every"]) {
        publication.rule = Rule::every;
        publication.every = p["every"].as<std::int64_t>();
      } else if (p.IsMap() && p["last_of"]) {
        publication.rule = Rule::last_of;
        publication.slots = slot_set(task.name + " " + publication.topic, topics_of(items(p["last_of"])));
      } else if (p.IsMap() && p["when"] && p["when"].as<std::string>() == "all_new") {
        publication.rule = Rule::all_new;
        publication.slots = slot_set(publication.topic, topics_of(items(p["of"])));
      }
      task.publications.push_back(publication);
    }
  }

  Task& timer(const YAML::Node& node, const std::string& name) {
    Task& task = add_task(name, node);
    task.timer = true;
    task.kind = "timer";
    task.period = task.deadline = nanoseconds(node["period_ms"]);
    if (node["phase_ms"]) task.phase = nanoseconds(node["phase_ms"]);
    if (node["deadline_ms"]) task.deadline = nanoseconds(node["deadline_ms"]);
    if (node["priority"]) task.priority = node["priority"].as<std::int64_t>();
    return task;
  }

  /// An input is a topic, {topic, depth, priority}, or a callback's {subscription, depth}.
  Task& subscription(const YAML::Node& input, const YAML::Node& node, std::size_t depth) {
    const std::string topic = topics_of({input})[0];
    Task& task = add_task(name_ + "/" + topic, node);
    task.depth = depth;
    if (input.IsMap() && input["depth"]) task.depth = input["depth"].as<std::size_t>();
    if (input.IsMap() && input["priority"]) task.priority = input["priority"].as<std::int64_t>();
    readers_[topic].push_back(static_cast<int>(graph_.tasks.size()) - 1);
    topics_[task.name] = topic;
    return task;
  }

  Task& add_task(const std::string& name, const YAML::Node& node) {
    graph_.tasks.push_back({name, name_});
    Task& task = graph_.tasks.back();
    task.group = group("");
    if (!node.IsMap()) return task;
    const YAML::Node time = node["execution_time_ms"];
    if (time && time.IsMap() && time["measured"]) {
      std::vector<Nanoseconds> values;
      for (const YAML::Node& value : time["measured"]) values.push_back(nanoseconds(value));
      task.best = std::ranges::min(values);
      task.worst = std::ranges::max(values);
    } else if (time && time.IsMap()) {
      task.best = nanoseconds(time["min"]);
      task.worst = nanoseconds(time["max"]);
    } else if (time) {
      task.best = task.worst = nanoseconds(time);
    }
    if (node["best_case_execution_time_ms"]) task.best = nanoseconds(node["best_case_execution_time_ms"]);
    return task;
  }

  static std::vector<std::string> topics_of(const std::vector<YAML::Node>& inputs) {
    std::vector<std::string> topics;
    for (const YAML::Node& input : inputs) {
      const YAML::Node topic = !input.IsMap()   ? input
                               : input["topic"] ? input["topic"]
                                                : input["subscription"];
      topics.push_back(topic.as<std::string>());
    }
    return topics;
  }

  int group(const std::string& name) {
    return groups_.try_emplace(name, groups_.contains(name) ? 0 : graph_.groups++).first->second;
  }

  /// Callbacks of a node that publish a topic when the same inputs are new share the set.
  int slot_set(const std::string& key, const std::vector<std::string>& topics) {
    const auto [entry, is_new] = sets_.try_emplace({key, topics}, static_cast<int>(graph_.slots.size()));
    if (is_new) graph_.slots.push_back(topics.size());
    return entry->second;
  }

  /// The slots of the node that keep samples of the task.
  void store(Task& task) {
    if (task.timer) return;
    for (const auto& [key, set] : sets_) {
      const auto position = std::ranges::find(key.second, topics_.at(task.name));
      if (position != key.second.end())
        task.stores.emplace_back(set, static_cast<int>(position - key.second.begin()));
    }
  }

  void add_chain(const YAML::Node& chain) {
    Chain result{chain["name"].as<std::string>(), {}, std::vector<bool>(graph_.tasks.size(), false)};
    std::vector<int> begins;
    for (const YAML::Node& name : items(chain["sources"])) {
      for (std::size_t t = 0; t < graph_.tasks.size(); ++t) {
        Task& task = graph_.tasks[t];
        if (task.name != name.as<std::string>() && !(task.timer && task.node == name.as<std::string>()))
          continue;
        begins.push_back(static_cast<int>(t));
        result.sources.push_back(sources_);
        task.sources.push_back(sources_++);
      }
    }
    graph_.ways.resize(static_cast<std::size_t>(sources_), ways_without_return(begins));
    if (sources_ > static_cast<int>(kMostSources)) throw std::runtime_error("too many sources");
    const auto sink = chain["sink"].as<std::string>();
    const auto belongs = [&](const Task& task) { return task.name == sink || task.node == sink; };
    const auto publishes = [&](const Task& task) { return belongs(task) && !task.publications.empty(); };
    const bool any = std::ranges::any_of(graph_.tasks, publishes);
    for (std::size_t t = 0; t < graph_.tasks.size(); ++t)
      result.is_sink[t] = any ? publishes(graph_.tasks[t]) : belongs(graph_.tasks[t]);
    graph_.chains.push_back(result);
  }

  /// Steps of data between messages, but none that returns: one on a cycle that does not lead further away
  /// from the tasks where the chain begins.
  std::set<std::pair<int, int>> ways_without_return(const std::vector<int>& begins) const {
    const std::size_t n = graph_.tasks.size();
    // Tasks whose messages have its data next: readers, and what publishes from their slots.
    const auto next = [&](int t) {
      std::set<int> found;
      for (const int reader : successors(graph_, t, true)) {
        found.insert(reader);
        for (const auto& [set, position] : graph_.tasks[static_cast<std::size_t>(reader)].stores) {
          for (std::size_t other = 0; other < n; ++other)
            for (const Publication& p : graph_.tasks[other].publications)
              if (p.slots == set) found.insert(static_cast<int>(other));
        }
      }
      return found;
    };
    const auto levels = [&](const std::vector<int>& from) {
      std::vector<int> level(n, -1);
      std::vector<int> now = from;
      for (int steps = 0; !now.empty(); ++steps) {
        std::vector<int> later;
        for (const int t : now) {
          if (level[static_cast<std::size_t>(t)] >= 0) continue;
          level[static_cast<std::size_t>(t)] = steps;
          for (const int s : next(t)) later.push_back(s);
        }
        now = later;
      }
      return level;
    };
    const std::vector<int> level = levels(begins);
    std::set<std::pair<int, int>> ways;
    for (std::size_t t = 0; t < n; ++t) {
      if (level[t] < 0) continue;
      for (const int s : next(static_cast<int>(t))) {
        const bool returns = level[static_cast<std::size_t>(s)] <= level[t] && levels({s})[t] >= 0;
        if (!returns) ways.emplace(static_cast<int>(t), s);
      }
    }
    return ways;
  }

  static std::string file_position(const YAML::Node& node) {
    return std::to_string(node.Mark().line + 1) + ": ";
  }

  Graph graph_;
  std::string name_;                                                      ///< Of the node being read.
  std::size_t first_ = 0;                                                 ///< Its first task.
  std::map<std::string, int> groups_;                                     ///< Of the node being read.
  std::map<std::pair<std::string, std::vector<std::string>>, int> sets_;  ///< Likewise.
  std::map<std::string, std::vector<int>> readers_;                       ///< By topic.
  std::map<std::string, std::string> topics_;                             ///< By subscription.
  int sources_ = 0;
};

}  // namespace

Graph read_graph(const std::string& file) { return Reader().read(file); }

std::vector<int> successors(const Graph& graph, int task, bool activations_only) {
  std::set<int> found;
  for (const Publication& p : graph.tasks[static_cast<std::size_t>(task)].publications)
    found.insert(p.readers.begin(), p.readers.end());
  if (activations_only) return {found.begin(), found.end()};
  for (const auto& [set, position] : graph.tasks[static_cast<std::size_t>(task)].stores) {
    for (std::size_t t = 0; t < graph.tasks.size(); ++t) {
      for (const Publication& p : graph.tasks[t].publications) {
        if (p.slots == set) found.insert(static_cast<int>(t));
      }
    }
  }
  return {found.begin(), found.end()};
}

}  // namespace independent
