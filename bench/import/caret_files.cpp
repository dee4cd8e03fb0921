// SPDX-License-Identifier: Apache-2.0
#include "import/caret_files.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

namespace fs = std::filesystem;

constexpr const char* kArchitecture = "an architecture of CARET is a YAML map with `nodes` and `executors`";
constexpr const char* kStats = "a file of CARET's stats_node is a YAML map of nodes with `callbacks`";

std::string name_of(const YamlMap& map, const std::string& key) {
  const std::string name = map.require(key, "NAME").text();
  return name == "UNDEFINED" ? "" : name;
}

std::vector<YamlValue> items(const YamlMap& map, const std::string& key) {
  const auto list = map.find(key);
  return list ? list->items("an item of `" + key + "`") : std::vector<YamlValue>();
}

std::vector<std::string> names(const YamlMap& map, const std::string& key) {
  std::vector<std::string> all;
  for (const YamlValue& item : items(map, key)) {
    if (item.text() != "UNDEFINED") all.push_back(item.text());
  }
  return all;
}

/// None for a callback of another kind.
std::optional<CaretCallback> read_callback(const YamlMap& map) {
  CaretCallback callback;
  callback.name = name_of(map, "callback_name");
  const YamlValue type = map.require("callback_type", "timer_callback");
  if (type.text() == "subscription_callback") {
    callback.topic = map.require("topic_name", "TOPIC").text();
  } else if (type.text() == "timer_callback") {
    callback.period =
        Duration(map.require("period_ns", "100000000").integer(1, std::numeric_limits<std::int64_t>::max()));
  } else {
    return std::nullopt;
  }
  return callback;
}

CaretNode read_node(const YamlValue& value, std::size_t& services) {
  YamlMap map(value, "a node");
  CaretNode node;
  node.name = name_of(map, "node_name");
  map.set_what("node " + node.name);
  for (const YamlValue& item : items(map, "callbacks")) {
    const auto callback = read_callback(YamlMap(item, "a callback of " + node.name));
    callback ? node.callbacks.push_back(*callback) : void(++services);
  }
  for (const YamlValue& item : items(map, "callback_groups")) {
    const YamlMap group(item, "a callback group of " + node.name);
    const bool reentrant = name_of(group, "callback_group_type") == "reentrant";
    node.groups.push_back({name_of(group, "callback_group_name"),
                           reentrant ? CallbackGroup::reentrant : CallbackGroup::mutually_exclusive,
                           names(group, "callback_names")});
  }
  for (const YamlValue& item : items(map, "publishes")) {
    const YamlMap publication(item, "a publication of " + node.name);
    node.publications.push_back({name_of(publication, "topic_name"), names(publication, "callback_names")});
  }
  for (const YamlValue& item : items(map, "message_contexts")) {
    const YamlMap context(item, "a message context of " + node.name);
    node.contexts.push_back(
        {name_of(context, "subscription_topic_name"), name_of(context, "publisher_topic_name")});
  }
  return node;
}

CaretPath read_path(const YamlValue& value) {
  const YamlMap map(value, "a path");
  CaretPath path;
  path.name = name_of(map, "path_name");
  for (const YamlValue& item : items(map, "node_chain")) {
    const YamlMap step(item, "a node of path " + path.name);
    path.steps.push_back({name_of(step, "node_name"), name_of(step, "subscribe_topic_name"),
                          name_of(step, "publish_topic_name")});
  }
  return path;
}

/// A number of milliseconds; none if CARET has none (`---`).
std::optional<Duration> milliseconds(const YamlValue& value) {
  const std::string text = value.text();
  if (text.find_first_not_of('-') == std::string::npos) return std::nullopt;
  try {
    return Duration(std::llround(std::stod(text) * 1e6));
  } catch (const std::exception&) {
    value.fail(program::concat("`", text, "` is not a number"), "give milliseconds, or --- for none");
  }
}

CaretStats read_callback_stats(const YamlMap& map) {
  CaretStats stats;
  if (const auto given = map.find("Period")) {
    stats.period = milliseconds(YamlMap(*given, "a period").require("avg", "100.0"));
  }
  const auto given = map.find("Latency");
  if (!given) return stats;
  const YamlMap latency(*given, "a latency");
  constexpr std::array<std::pair<const char*, double>, 5> kQuantiles = {
      {{"min", 0}, {"p50", 50}, {"p95", 95}, {"p99", 99}, {"max", 100}}};
  for (const auto& [key, percent] : kQuantiles) {
    const auto time = milliseconds(latency.require(key, "1.0"));
    if (time) stats.times.push_back({percent, *time});
  }
  return stats;
}

}  // namespace

CaretArchitecture read_caret_architecture(const std::string& file) {
  const YamlMap map(YamlValue(file, read_yaml(file, read_text_file(file), kArchitecture), "it", 1),
                    "the architecture");
  CaretArchitecture all;
  for (const YamlValue& node : map.require("nodes", "[]").list("a node")) {
    all.nodes.push_back(read_node(node, all.services));
  }
  for (const YamlValue& item : items(map, "executors")) {
    const YamlMap executor(item, "an executor");
    const bool several = name_of(executor, "executor_type").starts_with("multi");
    all.executors.push_back(
        {name_of(executor, "executor_name"), several, names(executor, "callback_group_names")});
  }
  for (const YamlValue& path : items(map, "named_paths")) all.paths.push_back(read_path(path));
  return all;
}

std::map<std::string, CaretStats> read_caret_stats(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> files;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == ".yaml") files.push_back(it->path());
  }
  if (files.empty()) {
    throw InputError(folder, 0, "there are no statistics (*.yaml) in this folder",
                     "give the folder stats_node of a report of CARET");
  }
  std::sort(files.begin(), files.end());
  std::map<std::string, CaretStats> all;
  for (const std::string& file : files) {
    const YamlMap nodes(YamlValue(file, read_yaml(file, read_text_file(file), kStats), "it", 1), "the file");
    for (const YamlValue& node : nodes.values()) {
      const YamlMap of_node(node, "a node");
      const auto callbacks = of_node.find("callbacks");
      if (!callbacks) of_node.fail("a node has no `callbacks`", kStats);
      const YamlMap map(*callbacks, "callbacks");
      for (const std::string& name : map.keys()) {
        all[name] = read_callback_stats(YamlMap(*map.find(name), name));
      }
    }
  }
  return all;
}

}  // namespace hotpath::imports
