// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_file.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include "graph_map.hpp"
#include "graph_source.hpp"
#include "hotpath/core/suggestion.hpp"

namespace hotpath {

namespace {

constexpr const char* kRemedy = "a graph is one YAML map that begins with `name: NAME` and lists `nodes`";

/// The words of a list, and their lines.
void read_words(const GraphMap& map, const std::string& key, const std::string& item,
                std::vector<std::string>& words, std::vector<int>& lines) {
  for (const YamlValue& word : map.needed(key).list(item)) {
    words.push_back(word.text());
    lines.push_back(word.line());
  }
}

void read_chain(const YamlValue& value, GraphSource& source) {
  GraphMap map(value, "a chain", KeysOf::chain);
  map.check();
  Chain& chain = source.graph.chains.emplace_back();
  ChainLines& lines = source.chains.emplace_back();
  lines.chain = map.line();
  map.read("name", chain.name);
  map.set_what("chain " + chain.name);
  read_words(map, "nodes", "a node of chain " + chain.name, chain.nodes, lines.nodes);
  if (map.find("sources"))
    read_words(map, "sources", "a source of chain " + chain.name, chain.sources, lines.sources);
  lines.sink = map.read("sink", chain.sink) ? map.find("sink")->line() : lines.chain;
}

void read_topics(const YamlValue& value, GraphSource& source) {
  const YamlMap topics(value, "`topics`");
  for (const std::string& topic : topics.keys()) {
    const GraphMap map(*topics.find(topic), "topic " + topic, KeysOf::topic_rule);
    map.check();
    TopicRule& rule = source.rules[topic];
    rule.line = map.line();
    const auto publishers = map.find("publishers"), delivery = map.find("delivery");
    bool intra_process = false;
    const bool stated = map.read("intra_process", intra_process);
    if (intra_process) source.graph.intra_process.insert(topic);
    if (!publishers && !delivery && !stated) {
      map.fail("topic " + topic + " has no rule",
               "give it `publishers: many`, `delivery: [NODE, NODE]`, `intra_process: true`, or remove it");
    }
    rule.many_publishers = publishers && publishers->choice({"one", "many"}) == 1;
    if (!delivery) continue;
    rule.delivery_line = delivery->line();
    DeliveryOrder& order = source.graph.delivery[topic];
    if (delivery->is_text()) {
      (void)delivery->choice({"unknown"});
      continue;
    }
    for (const YamlValue& node : delivery->list("a subscriber of topic " + topic))
      order.nodes.push_back(node.text());
  }
}

void read_platform(const YamlValue& value, GraphPlatform& platform) {
  const GraphMap map(value, "`platform`", KeysOf::platform);
  map.check();
  map.read_all(graph_keys::kOfPlatform, platform);
  for (const PlatformCost& cost : kPlatformCosts) {
    if (const auto given = map.find(std::string(cost.key))) cost.set(platform, given->microseconds());
  }
  auto& [longest, median, samples] = platform.measured_delivery;
  if (const auto given = map.find("measured_delivery_us")) longest = given->microseconds();
  if (const auto given = map.find("median_delivery_us")) median = given->microseconds();
  map.read("delivery_samples", samples);
}

/// The maps of keys that `--set` changes, by name: nodes, or the tasks of a node of type `callbacks`. Lists
/// of another form are rejected later.
std::map<std::string, YAML::Node> maps_by_name(const YAML::Node& list, const std::string& node = "") {
  std::map<std::string, YAML::Node> maps;
  if (!list || !list.IsSequence()) return maps;
  for (const YAML::Node& map : list) {
    if (!map.IsMap()) continue;
    std::string name = node;
    for (const char* key : {"name", "timer", "subscription"})
      if (map[key] && map[key].IsScalar()) name += map[key].Scalar();
    if (node.empty() && map["callbacks"])
      maps.merge(maps_by_name(map["callbacks"], name + "/"));
    else
      maps.emplace(name, map);
  }
  return maps;
}

/// Sets `NODE.KEY=VALUE`.
void set_key(const YAML::Node& document, const std::string& setting) {
  const std::size_t equals = setting.find('='), dot = setting.rfind('.', equals);
  if (equals == std::string::npos || dot == std::string::npos)
    throw InputError("--set " + setting, 0, "it is not NODE.KEY=VALUE",
                     "write, for example, Lidar.period_ms=50");
  const std::string name = setting.substr(0, dot), key = setting.substr(dot + 1, equals - dot - 1);
  std::map<std::string, YAML::Node> maps = maps_by_name(document["nodes"]);
  std::vector<std::string> names;
  names.reserve(maps.size());
  for (const auto& [known, map] : maps) names.push_back(known);
  if (!maps.contains(name))
    throw InputError("--set " + setting, 0, "the graph has no node " + name, suggest(name, names));
  maps[name].remove(key);  // an alias of its value, elsewhere in the file, keeps the old one
  maps[name][key] = setting.substr(equals + 1);
}

/// Checks each part separately.
GraphSource read_graph(const std::string& path, const std::vector<std::string>& set) {
  const YAML::Node document = read_yaml(path, read_text_file(path), kRemedy);
  GraphSource source;
  source.file = path;
  source.folder = std::filesystem::path(path).parent_path();
  for (const std::string& setting : set) set_key(document, setting);
  if (!set.empty()) source.file = "--set " + joined(set, ",") + ": " + path;
  const GraphMap map(source.file, document);
  Graph& graph = source.graph;
  map.read("name", graph.name);
  map.read("description", graph.description);
  map.read("work", graph.work);
  map.read("service_wait_ms", graph.service_wait);
  map.read("ros_distro", graph.release);
  if (const auto given = map.find("topics")) read_topics(*given, source);
  for (const YamlValue& node : map.needed("nodes").list("a node")) read_node(node, source);
  const auto has_service = [](const Node& n) {
    return std::ranges::any_of(n.callbacks, [](const Callback& c) { return is_service(c.entity); });
  };
  if (const auto wait = map.find("service_wait_ms"); wait && std::ranges::none_of(graph.nodes, has_service))
    wait->fail(
        "no callback of the graph is a service",
        "give `service: true`, `client: true` or `waitable: true` (an action) to the subscriptions that "
        "stand for one");
  if (const auto given = map.find("chains")) {
    for (const YamlValue& chain : given->list("a chain")) read_chain(chain, source);
  }
  if (const auto given = map.find("platform")) read_platform(*given, graph.platform);
  return source;
}

}  // namespace

Graph load_graph(const std::string& path, const std::vector<std::string>& set) {
  GraphSource source = read_graph(path, set);
  check_graph(source);
  Graph& graph = source.graph;
  for (Chain& chain : graph.chains)
    std::ranges::stable_sort(chain.nodes, {}, [&](const std::string& name) { return graph.find(name); });
  return std::move(graph);
}

}  // namespace hotpath
