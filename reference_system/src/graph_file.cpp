// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_file.hpp"

#include <algorithm>
#include <array>

#include "graph_callbacks.hpp"
#include "graph_source.hpp"
#include "hotpath/core/worker.hpp"
#include "hotpath/reference_system/reference_node.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"

namespace hotpath {

namespace {

using Words = std::vector<std::string>;

constexpr const char* kRemedy = "a graph is one YAML map that begins with `name: NAME` and lists `nodes`";

const Words kAllNodeKeys = {"name",
                            "type",
                            "execution_time_ms",
                            "best_case_execution_time_ms",
                            "callback_group",
                            "input",
                            "inputs",
                            "output",
                            "connections",
                            "period_ms",
                            "phase_ms",
                            "deadline_ms",
                            "release_jitter_ms",
                            "priority",
                            "groups",
                            "callbacks"};

Words node_keys(NodeType type) {
  if (type == NodeType::callbacks) return {"name", "type", "groups", "callbacks"};
  Words keys = {"name", "type", "execution_time_ms", "best_case_execution_time_ms", "callback_group"};
  const auto add = [&](const Words& more) { keys.insert(keys.end(), more.begin(), more.end()); };
  if (type == NodeType::sensor || type == NodeType::cyclic) {
    add({"period_ms", "phase_ms", "deadline_ms", "release_jitter_ms", "priority"});
  }
  if (type == NodeType::intersection) {
    add({"connections"});
  } else if (type != NodeType::sensor) {
    add({"input", "inputs"});
  }
  if (type != NodeType::intersection && type != NodeType::command) add({"output"});
  return keys;
}

ReferenceInput parse_input(const YamlValue& value, const std::string& node, std::uint32_t depth) {
  ReferenceInput input;
  input.depth = depth;
  if (value.is_text()) {
    input.topic = value.topic();
    return input;
  }
  const YamlMap map(value, "an input of " + node);
  map.check_keys({"topic", "depth", "priority"});
  input.topic = map.require("topic", "TOPIC").topic();
  if (const auto given = map.find("depth")) {
    input.depth = static_cast<std::uint32_t>(given->integer(1, kMaxDepth));
  }
  if (const auto given = map.find("priority")) {
    input.priority = given->priority();
  }
  return input;
}

void parse_inputs(const YamlMap& map, const std::string& subject, ReferenceNode& node, NodeLines& lines) {
  const std::uint32_t depth = default_depth(node.type);
  const auto one = map.find("input");
  const auto many = map.find("inputs");
  if (one && many)
    map.fail(subject + " has both `input` and `inputs`", "keep `inputs` for a list, `input` for one");
  std::vector<YamlValue> values;
  if (one) values.push_back(*one);
  if (many) values = many->list("an input of " + subject);
  for (const YamlValue& value : values) {
    node.inputs.push_back(parse_input(value, subject, depth));
    lines.inputs.push_back(value.line());
  }
  const std::string count =
      std::to_string(node.inputs.size()) + (node.inputs.size() == 1 ? " input" : " inputs");
  if (node.type == NodeType::cyclic && node.inputs.empty()) {
    map.fail(subject + " has no input",
             "a cyclic node stores messages of one input or more; without any it is a sensor");
  }
  if (node.type == NodeType::fusion && node.inputs.size() < 2) {
    map.fail(subject + " has " + count, "a fusion needs two or more; with one it is a transform");
  }
  if ((node.type == NodeType::transform || node.type == NodeType::command) && node.inputs.size() != 1) {
    map.fail(subject + " has " + count, "a " + std::string(to_string(node.type)) + " has exactly one");
  }
}

void parse_connections(const YamlMap& map, const std::string& subject, ReferenceNode& node, NodeLines& lines) {
  const YamlValue list = map.require("connections", "[{input: TOPIC, output: TOPIC}]");
  for (const YamlValue& value : list.list("a connection of " + subject)) {
    const YamlMap connection(value, "a connection of " + subject);
    connection.check_keys({"input", "output"});
    const YamlValue input = connection.require("input", "TOPIC");
    const YamlValue output = connection.require("output", "TOPIC");
    node.inputs.push_back(parse_input(input, subject, 1));
    node.outputs.push_back(output.topic());
    lines.inputs.push_back(input.line());
    lines.outputs.push_back(output.line());
  }
}

void parse_timer(const YamlMap& map, ReferenceNode& node) {
  node.period = map.require("period_ms", "100").milliseconds(false);
  node.deadline = node.period;
  if (const auto given = map.find("phase_ms")) node.phase = given->milliseconds(true);
  if (const auto given = map.find("deadline_ms")) node.deadline = given->milliseconds(false);
  node.release_jitter = parse_release_jitter(map, node.period);
  if (const auto given = map.find("priority")) {
    node.priority = given->priority();
  }
}

void parse_execution_time(const YamlMap& map, const std::string& subject, ReferenceNode& node) {
  if (const auto given = map.find("execution_time_ms")) node.execution_time = given->milliseconds(true);
  node.best_case_execution_time = node.execution_time;
  if (const auto given = map.find("best_case_execution_time_ms")) {
    node.best_case_execution_time = given->milliseconds(true);
    if (node.best_case_execution_time > node.execution_time) {
      given->fail("the best case of " + subject + " is longer than its execution time",
                  "give a `best_case_execution_time_ms` of at most `execution_time_ms`");
    }
  }
}

/// A node of one of the six types.
void parse_upstream_node(const YamlMap& map, const std::string& subject, ReferenceNode& node, NodeLines& lines) {
  if (node.type == NodeType::sensor || node.type == NodeType::cyclic) parse_timer(map, node);
  parse_execution_time(map, subject, node);
  if (const auto given = map.find("callback_group")) {
    node.group = given->choice<CallbackGroup>();
  }
  if (node.type == NodeType::intersection) {
    parse_connections(map, subject, node, lines);
  } else {
    if (node.type != NodeType::sensor) parse_inputs(map, subject, node, lines);
    if (node.type != NodeType::command) {
      const auto given = map.find("output");
      node.outputs.push_back(given ? given->topic() : node.name);
      lines.outputs.push_back(given ? given->line() : lines.node);
    }
  }
}

void parse_node(const YamlValue& value, GraphSource& source) {
  YamlMap map(value, "a node");
  Node& node = source.graph.nodes.emplace_back();
  NodeLines lines;
  lines.node = map.line();
  const YamlValue name = map.require("name", "NAME");
  node.name = name.long_name();
  const std::string subject = "node " + node.name;
  map.set_what(subject);
  node.type = map.require("type", "sensor").choice<NodeType>();
  map.set_what(to_string(node.type) + (" " + node.name));
  map.check_keys(node_keys(node.type), kAllNodeKeys);
  if (node.type == NodeType::callbacks) {
    parse_callbacks(map, source.file, node, lines);
  } else {
    ReferenceNode short_form;
    short_form.name = name.name();
    short_form.type = node.type;
    parse_upstream_node(map, subject, short_form, lines);
    node = short_form;
  }
  source.nodes.push_back(std::move(lines));
}

void parse_chain(const YamlValue& value, GraphSource& source) {
  YamlMap map(value, "a chain");
  map.check_keys({"name", "nodes", "sources", "sink"});
  Chain chain;
  ChainLines lines;
  lines.chain = map.line();
  chain.name = map.require("name", "NAME").name();
  map.set_what("chain " + chain.name);
  for (const YamlValue& node :
       map.require("nodes", "[SOURCE, ..., SINK]").list("a node of chain " + chain.name)) {
    chain.nodes.push_back(node.text());
    lines.nodes.push_back(node.line());
  }
  for (const YamlValue& node : map.require("sources", "[SOURCE]").list("a source of chain " + chain.name)) {
    chain.sources.push_back(node.text());
    lines.sources.push_back(node.line());
  }
  const YamlValue sink = map.require("sink", "SINK");
  chain.sink = sink.text();
  lines.sink = sink.line();
  source.graph.chains.push_back(std::move(chain));
  source.chains.push_back(std::move(lines));
}

void parse_topics(const YamlValue& value, GraphSource& source) {
  const YamlMap topics(value, "`topics`");
  for (const std::string& topic : topics.keys()) {
    const YamlMap map(*topics.find(topic), "topic " + topic);
    map.check_keys({"publishers", "delivery"});
    TopicRule& rule = source.rules[topic];
    rule.line = map.line();
    const auto publishers = map.find("publishers"), delivery = map.find("delivery");
    if (!publishers && !delivery) {
      map.fail("topic " + topic + " has no rule",
               "give it `publishers: many`, `delivery: [NODE, NODE]`, or remove it");
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

bool has_service(const Node& node) { return std::ranges::any_of(node.callbacks, &Callback::service); }

GraphPlatform parse_platform(const YamlValue& value) {
  const YamlMap map(value, "`platform`");
  Words keys = {"cores", "timer_thread", "execution_times"};
  for (const PlatformCost& cost : kPlatformCosts) keys.emplace_back(cost.key);
  map.check_keys(keys);
  GraphPlatform p;
  if (const auto given = map.find("cores")) p.cores = static_cast<unsigned>(given->integer(1, kMaxWorkers));
  if (const auto given = map.find("timer_thread")) {
    p.timer_thread = given->choice<TimerThread>();
  }
  if (const auto given = map.find("execution_times")) {
    p.execution_times = given->choice<ExecutionTimeModel>();
  }
  for (const PlatformCost& cost : kPlatformCosts) {
    if (const auto given = map.find(std::string(cost.key))) cost.set(p, given->microseconds());
  }
  return p;
}

}  // namespace

GraphSource parse_graph(const std::string& file, const std::string& text) {
  GraphSource source;
  source.file = file;
  const YamlMap map(YamlValue(source.file, read_yaml(file, text, kRemedy), "the graph", 1), "the graph");
  map.check_keys({"name", "description", "work", "service_wait_ms", "topics", "nodes", "chains", "platform"});
  Graph& graph = source.graph;
  graph.name = map.require("name", "NAME").name();
  if (const auto given = map.find("description")) graph.description = given->text();
  if (const auto given = map.find("work")) graph.work = given->choice<WorkMode>();
  const auto service_wait = map.find("service_wait_ms");
  if (service_wait) graph.service_wait = service_wait->milliseconds(true);
  if (const auto given = map.find("topics")) parse_topics(*given, source);
  for (const YamlValue& node :
       map.require("nodes", "[{name: NAME, type: sensor, period_ms: 100}]").list("a node")) {
    parse_node(node, source);
  }
  if (service_wait && std::ranges::none_of(graph.nodes, has_service)) {
    service_wait->fail("no callback of the graph is a service",
                       "give `service: true` to the subscriptions that stand for services and clients");
  }
  if (const auto given = map.find("chains")) {
    for (const YamlValue& chain : given->list("a chain")) parse_chain(chain, source);
  }
  if (const auto given = map.find("platform")) graph.platform = parse_platform(*given);
  return source;
}

Graph load_graph(const std::string& path) {
  GraphSource source = parse_graph(path, read_text_file(path));
  check_graph(source);
  Graph& graph = source.graph;
  for (Chain& chain : graph.chains) {
    std::stable_sort(chain.nodes.begin(), chain.nodes.end(), [&](const std::string& a, const std::string& b) {
      return graph.find(a) < graph.find(b);
    });
  }
  return std::move(graph);
}

}  // namespace hotpath
