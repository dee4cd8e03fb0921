// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_file.hpp"

#include <algorithm>

#include "graph_map.hpp"
#include "graph_source.hpp"

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
  read_words(map, "sources", "a source of chain " + chain.name, chain.sources, lines.sources);
  map.read("sink", chain.sink);
  lines.sink = map.needed("sink").line();
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
}

/// Checks each part separately.
GraphSource read_graph(const std::string& file, const std::string& text) {
  GraphSource source;
  source.file = file;
  const GraphMap map(source.file, text, kRemedy);
  Graph& graph = source.graph;
  map.read("name", graph.name);
  map.read("description", graph.description);
  map.read("work", graph.work);
  const bool waits = map.read("service_wait_ms", graph.service_wait);
  if (const auto given = map.find("topics")) read_topics(*given, source);
  for (const YamlValue& node : map.needed("nodes").list("a node")) read_node(node, source);
  const auto has_service = [](const Node& n) {
    return std::ranges::any_of(n.callbacks,
                               [](const Callback& c) { return c.entity != EntityKind::subscription; });
  };
  if (waits && std::ranges::none_of(graph.nodes, has_service)) {
    map.find("service_wait_ms")
        ->fail(
            "no callback of the graph is a service",
            "give `service: true`, `client: true` or `waitable: true` (an action) to the subscriptions that "
            "stand for one");
  }
  if (const auto given = map.find("chains")) {
    for (const YamlValue& chain : given->list("a chain")) read_chain(chain, source);
  }
  if (const auto given = map.find("platform")) read_platform(*given, graph.platform);
  return source;
}

}  // namespace

Graph load_graph(const std::string& path) {
  GraphSource source = read_graph(path, read_text_file(path));
  check_graph(source);
  Graph& graph = source.graph;
  for (Chain& chain : graph.chains)
    std::ranges::stable_sort(chain.nodes, {}, [&](const std::string& name) { return graph.find(name); });
  return std::move(graph);
}

}  // namespace hotpath
