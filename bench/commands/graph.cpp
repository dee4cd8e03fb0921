// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_picture.hpp"
#include "program/errors.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::commands {

namespace {

/// What --as writes instead of the description.
enum class Form : std::uint8_t { dot, cie };

constexpr auto enum_texts(Form) {
  return std::to_array<EnumText<Form>>({{Form::dot, "dot"}, {Form::cie, "cie"}});
}

struct GraphOptions {
  std::string graph, deployment;
  std::optional<Form> as;
};

void print_platform(const GraphPlatform& platform) {
  std::cout << program::text("platform of simulations: %u core%s, timer thread %s, execution times %s",
                             platform.cores, platform.cores == 1 ? "" : "s", to_string(platform.timer_thread),
                             to_string(platform.execution_times));
  for (const PlatformCost& cost : kPlatformCosts) {
    const Duration value = cost.in(platform).value_or(Duration{});
    if (value > Duration{})
      std::cout << program::text(", %s %g", std::string(cost.key).c_str(), to_us(value));
  }
  std::cout << "\n";
}

void print_cie(const GraphOptions& options, const Graph& graph, const GraphTasks& tasks) {
  const std::string name = options.deployment.empty() ? "cie" : options.deployment;
  try {
    write_cie(program::data_output(), graph, tasks, find_deployment(name, graph, tasks));
  } catch (const std::invalid_argument& error) {
    throw program::UsageError(error.what());
  }
}

void print_graph(const GraphOptions& options) {
  const Graph graph = load_graph(find_graph(options.graph));
  const GraphTasks tasks = make_tasks(graph);
  if (options.as == Form::cie) return print_cie(options, graph, tasks);
  if (options.as) {
    if (options.deployment.empty()) return write_dot(program::data_output(), graph);
    const Deployment deployment = find_deployment(options.deployment, graph, tasks);
    return write_dot(program::data_output(), graph, tasks, deployment);
  }
  if (!options.deployment.empty()) throw program::UsageError("--deployments: add --as dot or cie");
  std::size_t timers = 0;
  for (const Task& task : tasks.set.tasks) timers += task.kind == TaskKind::timer;
  std::cout << program::text("%s: %s\n%zu nodes, %zu subscriptions, %zu timers, load %.1f %% of one core\n",
                             graph.name.c_str(), graph.description.c_str(), graph.nodes.size(),
                             tasks.set.tasks.size() - timers, timers, load_percent(graph));
  for (const Chain& chain : graph.chains) {
    std::cout << program::text("chain %s:", chain.name.c_str());
    for (const std::string& node : chain.nodes) std::cout << program::text(" %s", node.c_str());
    std::cout << "\n";
  }
  print_platform(graph.platform);
  for (const std::string& sentence : setup::utilisation(graph, tasks, nullptr).warnings)
    std::cout << sentence << "\n";
}

}  // namespace

void add_graph_command(CLI::App& app) {
  auto [graph, o] = add_command<GraphOptions>(app, "graph", "Check a graph file and print or draw the graph",
                                              "", print_graph);
  add_graph_option(graph, o.graph)->required();
  add_choice(graph, "--as", o.as,
             "Write the graph for Graphviz with its hot path marked, or as YAML\n"
             "for Autoware's CallbackIsolatedExecutor, to standard output");
  add_text(graph, "--deployments", o.deployment, "NAME",
           "Deployment (`hotpath list deployments`, or a YAML file) that\n"
           "colours the nodes of --as dot, or gives --as cie its threads");
}

const Command kGraph("Predict", 80, add_graph_command);

}  // namespace hotpath::commands
