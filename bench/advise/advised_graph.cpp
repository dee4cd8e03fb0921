// SPDX-License-Identifier: Apache-2.0
#include "advise/advised_graph.hpp"

#include <cmath>
#include <iostream>

#include "hotpath/reference_system/find_chains.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::advise {

Graph advised_graph(const Options& options) {
  constexpr std::size_t kMostChains = 8;
  Graph graph = setup::graph_to_run(options);
  if (options.cores) graph.platform.cores = *options.cores;
  if (graph.chains.empty()) {
    graph.chains = find_chains(graph, make_tasks(graph), kMostChains);
    for (const Chain& chain : graph.chains) {
      std::cout << "Found " << chain.name << ": " << program::joined(chain.nodes, " -> ") << "\n";
    }
  }
  return graph;
}

Objective advised_objective(const Options& options, const Graph& graph, const std::string& usual) {
  return parse_objective(options.objective.value_or(graph.chains.empty() ? "worst_lateness" : usual), graph);
}

CandidateOptions candidate_options(const Options& options, const Graph& graph, const std::string& usual) {
  const std::string costs = options.costs.value_or(usual);
  if (costs != "reference" && costs != "graph") {
    throw program::UsageError("--costs: `" + costs + "` is neither reference nor graph");
  }
  CandidateOptions o;
  o.executors = options.executors;
  o.deployments = options.deployments;
  o.now = options.now;
  o.scheduling = setup::scheduling_of(options, graph, make_tasks(graph).set, graph.platform.cores);
  o.reference_costs = costs == "reference";
  return o;
}

void check_load(const Graph& graph, const GraphTasks& tasks) {
  const double load = mean_load_percent(graph, tasks);
  if (load < 100.0 * graph.platform.cores) return;
  throw program::OverloadError(program::concat(
      "overload: the callbacks of ", graph.name, " need ", program::fixed(load, 0),
      " % of one core, and there ", graph.platform.cores == 1 ? "is " : "are ", graph.platform.cores,
      graph.platform.cores == 1 ? " core" : " cores", ": no executor can keep up; give the graph ",
      std::floor(load / 100) + 1, " cores or more (--cores), or less work (--load)"));
}

}  // namespace hotpath::advise
