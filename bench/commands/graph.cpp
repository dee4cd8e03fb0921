// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_layout.hpp"
#include "program/shown_text.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::commands {

namespace {

/// What --as writes instead of the description.
enum class Form : std::uint8_t { dot, cie };

constexpr auto enum_texts(Form) { return texts_in_order<Form>({"dot", "cie"}); }

/// What --new writes.
constexpr const char* kExample =
    R"(# A graph of nodes, with the topics between them and the chain that is measured. docs/graphs.md has all keys.
# Check this file:      hotpath graph FILE          Compare executors:  hotpath simulate FILE
# Try another value:    hotpath simulate FILE --set Lidar.period_ms=50
name: robot
description: a lidar and a camera steer a robot
nodes:
  # Drivers publish by a timer. A topic has the name of its node, unless `output` gives another one.
  - {name: Lidar, type: sensor, period_ms: 100, execution_time_ms: 8}
  - {name: Camera, type: sensor, period_ms: 40, execution_time_ms: 5}
  # A fusion publishes when each of its inputs has a new sample.
  - {name: Fusion, type: fusion, inputs: [Lidar, Camera], execution_time_ms: 20}
  - {name: Actuator, type: command, input: Fusion, execution_time_ms: 2}
  # A node beside the chain, whose jobs may delay it.
  - {name: Diagnostics, type: sensor, period_ms: 300, execution_time_ms: 60}
chains:  # Their latencies are measured, from the first nodes to the last one.
  - {name: steering, nodes: [Lidar, Camera, Fusion, Actuator]}
platform: {cores: 1}  # The simulated machine.
)";

struct GraphOptions {
  std::string graph, deployment, new_file;
  std::vector<std::string> set;
  std::optional<Form> as;
};

void print_platform(const GraphPlatform& platform) {
  std::cout << text("platform of simulations: %u core%s, timer thread %s, execution times %s", platform.cores,
                    platform.cores == 1 ? "" : "s", to_string(platform.timer_thread),
                    to_string(platform.execution_times));
  for (const PlatformCost& cost : kPlatformCosts) {
    const Duration value = cost.in(platform).value_or(Duration{});
    if (value > Duration{}) std::cout << text(", %s %g", std::string(cost.key).c_str(), to_us(value));
  }
  std::cout << "\n";
}

void print_cie(const GraphOptions& options, const Graph& graph, const GraphTasks& tasks) {
  const std::string name = options.deployment.empty() ? "cie" : options.deployment;
  try {
    write_cie(program::data_output(), graph, tasks, find_deployment(name, graph, tasks));
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

void print_graph(const GraphOptions& options) {
  if (!options.new_file.empty()) return write_example(options.new_file, kExample, "simulate");
  if (options.graph.empty()) throw CLI::RequiredError("--graph");
  const Graph graph = load_graph(find_graph(options.graph), options.set);
  const GraphTasks tasks = make_tasks(graph);
  if (options.as == Form::cie) return print_cie(options, graph, tasks);
  if (options.as) {
    if (options.deployment.empty()) return write_dot(program::data_output(), graph);
    const Deployment deployment = find_deployment(options.deployment, graph, tasks);
    return write_dot(program::data_output(), graph, &deployment);
  }
  if (!options.deployment.empty()) throw UsageError("--deployments: add --as dot or cie");
  const std::size_t timers = tasks.set.timers().size();
  std::cout << text("%s: %s\n%zu nodes, %zu subscriptions, %zu timers, load %.1f %% of one core\n",
                    graph.name.c_str(), graph.description.c_str(), graph.nodes.size(),
                    tasks.set.tasks.size() - timers, timers, load_percent(graph));
  for (const Chain& chain : graph.chains) {
    std::cout << text("chain %s:", chain.name.c_str());
    for (const std::string& node : chain.nodes) std::cout << text(" %s", node.c_str());
    std::cout << "\n";
  }
  print_platform(graph.platform);
  for (const std::string& sentence : setup::utilisation(graph, tasks, nullptr).warnings)
    std::cout << sentence << "\n";
}

}  // namespace

const Command kGraph("Predict", 80, [](CLI::App& app) {
  auto [graph, o] = add_command<GraphOptions>(app, "graph", "Check a graph file and print or draw the graph",
                                              "hotpath graph --new robot.yaml", print_graph);
  add(graph, "GRAPH,--graph", o.graph, "NAME", kGraphHelp);
  add(graph, "--new", o.new_file, "FILE", "Write a commented example of a graph into this new file");
  add_set_option(graph, o.set);
  add(graph, "--as", o.as,
      "Write the graph for Graphviz with its hot path marked, or as YAML\n"
      "for Autoware's CallbackIsolatedExecutor, to standard output");
  add(graph, "--deployments", o.deployment, "NAME",
      "Deployment (`hotpath list deployments`, or a YAML file) that colours the nodes of --as dot, or gives "
      "--as cie its threads");
  show_first(graph, {"--new", "--set", "--as", "--deployments"});
  graph.get_option("--new")->excludes("--graph", "--set", "--as", "--deployments");
});

}  // namespace hotpath::commands
