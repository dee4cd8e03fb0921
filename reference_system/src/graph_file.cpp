// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_file.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include "graph_source.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "a graph is one YAML map that begins with `name: NAME` and lists `nodes`";

DeliveryOrder read_delivery(const YamlValue& value, const std::string& topic, const Graph& graph) {
  DeliveryOrder order;
  if (value.is_text()) {
    (void)value.choice({"unknown"});
    return order;
  }
  for (const YamlValue& node : value.list("a subscriber of topic " + topic))
    order.nodes.push_back(node.text());
  const std::string subject = "`delivery` of topic " + topic;
  std::vector<std::string> left = subscribers_of(graph, topic);  // not yet listed
  for (const std::string& node : order.nodes) {
    if (std::erase(left, node) > 0) continue;
    const std::string listed = std::string(subject).append(" lists node ").append(node);
    if (std::ranges::count(order.nodes, node) > 1) value.fail(listed + " twice", "list each subscriber once");
    value.fail(listed + ", which does not subscribe to it", suggest(node, left));
  }
  if (!left.empty())
    value.fail(subject + " lacks subscriber " + left.front(), "list all subscribers, first reached first");
  return order;
}

/// Returns the topics that several nodes may publish.
std::set<std::string> read_topics(const YamlValue& value, Graph& graph) {
  const std::vector<std::string> published = published_topics(graph);
  std::set<std::string> shared;
  const YamlMap topics(value, "`topics`");
  for (const std::string& topic : topics.keys()) {
    const GraphMap map(*topics.find(topic), "topic " + topic, KeysOf::topic_rule);
    map.check();
    const auto publishers = map.find("publishers"), delivery = map.find("delivery");
    bool intra_process = false;
    const bool stated = map.read("intra_process", intra_process);
    if (!publishers && !delivery && !stated)
      map.fail("topic " + topic + " has no rule",
               "give it `publishers: many`, `delivery: [NODE, NODE]`, `intra_process: true`, or remove it");
    if (publishers && publishers->choice({"one", "many"}) == 1) shared.insert(topic);
    if (std::ranges::count(published, topic) == 0)
      map.fail("no node publishes topic " + topic + " of `topics`", suggest(topic, published));
    if (intra_process) graph.intra_process.insert(topic);
    if (delivery) graph.delivery[topic] = read_delivery(*delivery, topic, graph);
  }
  return shared;
}

void read_platform(const YamlValue& value, GraphPlatform& platform) {
  const GraphMap map(value, "`platform`", KeysOf::platform);
  map.check();
  map.read_all(graph_keys::kOfPlatform, platform);
  const auto read_us = [&](std::string_view key, const auto& set) {
    if (const auto given = map.find(std::string(key))) set(given->microseconds());
  };
  for (const PlatformCost& cost : kPlatformCosts)
    read_us(cost.key, [&](Duration time) { cost.set(platform, time); });
  MeasuredDelivery& delivery = platform.measured_delivery;
  read_us("measured_delivery_us", [&](Duration time) { delivery.longest = time; });
  read_us("median_delivery_us", [&](Duration time) { delivery.median = time; });
  map.read("delivery_samples", delivery.samples);
}

/// The maps of keys that `--set` changes, by name: nodes, or the tasks of a
/// node of type `callbacks`. Lists of another form are rejected later.
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

std::map<std::string, fs::path> graph_files() { return yaml_files("HOTPATH_GRAPHS", HOTPATH_GRAPH_DIRS); }

}  // namespace

Graph load_graph(const std::string& path, const std::vector<std::string>& set) {
  const YAML::Node document = read_yaml(path, read_text_file(path), kRemedy);
  for (const std::string& setting : set) set_key(document, setting);
  GraphSource source;
  source.file = (set.empty() ? "" : "--set " + joined(set, ",") + ": ") + path;
  source.folder = fs::path(path).parent_path();
  const GraphMap map(YamlValue(source.file, document, "the graph", 1), "the graph", KeysOf::graph);
  map.check();
  Graph& graph = source.graph;
  map.read("name", graph.name);
  map.read("description", graph.description);
  map.read("work", graph.work);
  map.read_all(graph_keys::kOfGraph, graph);
  for (const YamlValue& node : map.needed("nodes").list("a node")) read_node(node, source);
  const auto has_service = [](const Node& n) {
    return std::ranges::any_of(n.callbacks, [](const Callback& c) { return is_service(c.entity); });
  };
  if (map.find("service_wait_ms") && std::ranges::none_of(graph.nodes, has_service))
    map.find("service_wait_ms")
        ->fail("no callback of the graph is a service",
               "give `service: true`, `client: true` or `waitable: true` (an action) to the subscriptions "
               "that stand for one");
  if (const auto given = map.find("platform")) read_platform(*given, graph.platform);
  const auto topics = map.find("topics"), chains = map.find("chains");
  const GraphTasks tasks =
      check_nodes(source, topics ? read_topics(*topics, graph) : std::set<std::string>());
  if (chains)
    for (const YamlValue& chain : chains->list("a chain")) read_chain(chain, tasks, graph);
  return std::move(graph);
}

std::string find_graph(const std::string& name_or_path) {
  std::error_code error;
  if (is_yaml_path(name_or_path)) {
    if (fs::exists(fs::status(name_or_path, error))) return name_or_path;
    refuse_input(name_or_path, error.message(),
                 "give the path of a graph file or one of the names of `hotpath list graphs`");
  }
  return find_yaml("graph", graph_files(), name_or_path);
}

std::optional<fs::path> find_ros2_reference() {
  std::istringstream folders(HOTPATH_ROS2_REFERENCE_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code ignored;
    if (fs::is_directory(folder, ignored)) return folder;
  }
  return std::nullopt;
}

std::vector<FileListing> list_files(const std::map<std::string, fs::path>& files,
                                    const std::function<void(FileListing&)>& describe) {
  std::vector<FileListing> listings;
  for (const auto& [name, path] : files) {
    FileListing& listing = listings.emplace_back();
    listing.name = name;
    listing.path = path;
    try {
      describe(listing);
    } catch (const InputError& error) {
      listing.error = error.what();
    }
  }
  return listings;
}

std::vector<FileListing> list_graphs() {
  return list_files(graph_files(), [](FileListing& listing) {
    const Graph graph = load_graph(listing.path);
    listing.description = graph.description;
    listing.nodes = graph.nodes.size();
  });
}

}  // namespace hotpath
