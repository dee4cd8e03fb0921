// SPDX-License-Identifier: Apache-2.0
// Topologies of irobot-ros/ros2-performance, see its create_new_topology.md: publishers are timers,
// subscribers only count what they receive.
#include "import/import_irobot.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/find_chains.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "import/imported_graph.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

constexpr const char* kRemedy = "a topology is a JSON object with a list of `nodes`";
constexpr std::uint32_t kDefaultDepth = 10;  // rmw_qos_profile_default
constexpr std::size_t kMostChains = 8;

/// JSON is YAML, whose reader knows lines; this one knows what JSON is.
void check_json(const std::string& file, const std::string& text) {
  try {
    std::ignore = nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    const std::string what = error.what();
    throw InputError(file, 1 + std::count(text.begin(), end, '\n'),
                     "not valid JSON: " + what.substr(what.rfind(": ") + 2), kRemedy);
  } catch (const nlohmann::json::out_of_range&) {  // which knows no place
    throw InputError(file, 1, "a number is too large", kRemedy);
  }
}

double number(const YamlValue& value) {
  try {
    return std::stod(value.text());
  } catch (const std::exception&) {
    value.fail(concat("`", value.text(), "` is no number"), "give a number");
  }
}

class Topology {
 public:
  explicit Topology(const std::string& file) : file_(file) {
    const std::string text = read_text_file(file);
    check_json(file, text);
    const YamlMap map(YamlValue(file_, read_yaml(file, text, kRemedy), "the topology", 1), "the topology");
    Graph& graph = imported_.graph;
    graph.name = printable(graph_node_name(std::filesystem::path(file).stem()), kMaxNameBytes);
    graph.description = "Topology " + graph.name + " of irobot-ros/ros2-performance";
    for (const YamlValue& node : map.require("nodes", "[{node_name: NAME}]").list("a node")) read_node(node);
    leave_out_unpublished();
    leave_out_empty();
    const GraphTasks tasks = make_tasks(graph);
    graph.chains = find_chains(graph, tasks, kMostChains);
    deploy(tasks);
    say();
  }

  ImportedGraph take() { return std::move(imported_); }

 private:
  void read_node(const YamlValue& value) {
    YamlMap map(value, "a node");
    map.check_keys({"node_name", "number", "executor_id", "publishers", "subscribers", "clients", "servers"});
    const std::string name = graph_node_name(map.require("node_name", "NAME").text());
    map.set_what("node " + name);
    Node node;
    node.type = NodeType::callbacks;
    node.groups = {CallbackGroup::mutually_exclusive};
    if (const auto given = map.find("publishers")) {
      for (const YamlValue& item : given->items("a publisher of " + name)) read_publisher(item, node);
    }
    if (const auto given = map.find("subscribers")) {
      for (const YamlValue& item : given->items("a subscriber of " + name)) read_subscriber(item, node);
    }
    for (const char* const key : {"clients", "servers"}) {
      if (const auto given = map.find(key)) services_ += given->items(key).size();
    }
    const auto copies = map.find("number");
    const std::int64_t count = copies ? copies->integer(1, 1000) : 1;
    const auto executor = map.find("executor_id");
    for (std::int64_t i = 1; i <= count; ++i) {
      Node& copy = imported_.graph.nodes.emplace_back(node);
      copy.name = count > 1 || copies ? concat(name, "_", i) : name;
      for (Callback& c : copy.callbacks) c.task = copy.name + "/" + c.task;
      if (executor) executor_of_[copy.name] = executor->integer(0, 1'000'000);
    }
  }

  /// Its topic, after a look at its keys.
  static std::string topic_of(const YamlMap& map) {
    std::vector<std::string> keys = {"topic_name", "msg_type",    "msg_size",
                                     "period_ms",  "msg_pass_by", "freq_hz"};
    for (const std::string& key : map.keys()) {
      if (key.starts_with("qos_")) keys.push_back(key);
    }
    map.check_keys(keys);
    return graph_topic_name(map.require("topic_name", "TOPIC").topic());
  }

  static void read_publisher(const YamlValue& item, Node& node) {
    const YamlMap map(item, "a publisher");
    Callback timer;
    timer.task = topic_of(map);
    std::replace(timer.task.begin(), timer.task.end(), '/', '.');
    const std::string topic = graph_topic_name(map.require("topic_name", "TOPIC").topic());
    timer.publishes.emplace_back().topic = topic;
    if (const auto hertz = map.find("freq_hz")) {
      const double given = number(*hertz);
      if (!(given > 0)) hertz->fail(concat("a frequency of ", given, " Hz"), "give more than 0");
      timer.period = std::chrono::microseconds(static_cast<std::int64_t>(1e6 / given));  // as there
    } else {
      timer.period = map.require("period_ms", "100").milliseconds(false);
    }
    timer.deadline = timer.period;
    node.outputs.push_back(topic);
    node.callbacks.push_back(std::move(timer));
  }

  static void read_subscriber(const YamlValue& item, Node& node) {
    const YamlMap map(item, "a subscriber");
    Callback subscription;
    subscription.task = topic_of(map);
    subscription.input = static_cast<std::uint32_t>(node.inputs.size());
    Input& input = node.inputs.emplace_back();
    input.topic = subscription.task;
    input.depth = kDefaultDepth;
    if (const auto depth = map.find("qos_depth")) {
      input.depth = static_cast<std::uint32_t>(depth->integer(1, 1000));
    }
    node.callbacks.push_back(std::move(subscription));
  }

  void leave_out_unpublished() {
    std::set<std::string> published;
    for (const Node& node : imported_.graph.nodes) {
      published.insert(node.outputs.begin(), node.outputs.end());
    }
    for (Node& node : imported_.graph.nodes) {
      std::vector<Input> inputs;
      std::erase_if(node.callbacks, [&](Callback& callback) {
        if (!callback.input) return false;
        const Input& input = node.inputs[*callback.input];
        if (!published.contains(input.topic)) {
          imported_.missing.push_back(concat("nobody publishes ", input.topic, ", to which ", node.name,
                                             " subscribes; the subscription is left out."));
          return true;
        }
        callback.input = static_cast<std::uint32_t>(inputs.size());
        inputs.push_back(input);
        return false;
      });
      node.inputs = std::move(inputs);
    }
  }

  void leave_out_empty() {
    std::erase_if(imported_.graph.nodes, [&](const Node& node) {
      if (!node.callbacks.empty()) return false;
      imported_.missing.push_back("node " + node.name + " has no callbacks and is left out.");
      return true;
    });
    if (imported_.graph.nodes.empty()) {
      throw InputError(file_, 1, "no node of this topology has a callback", kRemedy);
    }
  }

  void deploy(const GraphTasks& tasks) {
    if (executor_of_.empty()) return;
    Deployment& deployment = imported_.deployment;
    deployment.name = imported_.graph.name;
    deployment.description = "Executors of the topology " + imported_.graph.name;
    std::map<std::int64_t, std::uint32_t> index;
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      // A node without the key gets a thread of its own there; here these share one.
      const auto given = executor_of_.find(imported_.graph.nodes[tasks.origin[id].node].name);
      const std::int64_t number = given == executor_of_.end() ? -1 : given->second;
      const auto [found, is_new] =
          index.emplace(number, static_cast<std::uint32_t>(deployment.executors.size()));
      if (is_new) {
        DeployedExecutor& executor = deployment.executors.emplace_back();
        executor.name = number < 0 ? "others" : concat("executor_", number);
        executor.executor = kBaselineExecutor;
      }
      deployment.executor_of.push_back(found->second);
    }
  }

  void say() {
    imported_.comments.header =
        "Made by `hotpath import irobot` of " + std::filesystem::path(file_).filename().string() + ".";
    imported_.found.push_back(counts_of(imported_));
    imported_.missing.push_back(
        "how long callbacks work; a topology has no times, and its subscribers only count messages. "
        "Sizes of messages are not part of a graph.");
    if (services_ > 0) imported_.missing.push_back(concat(services_, " services and clients are left out."));
  }

  const std::string file_;
  ImportedGraph imported_;
  std::map<std::string, std::int64_t> executor_of_;  // by node
  std::size_t services_ = 0;
};

}  // namespace

void import_irobot(const ImportIrobotOptions& options) {
  const std::string output = options.output.empty()
                                 ? "imports/" + std::filesystem::path(options.file).stem().string()
                                 : options.output;
  check_output_folder(output);
  write_import(Topology(options.file).take(), output);
}

}  // namespace hotpath
