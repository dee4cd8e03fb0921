// SPDX-License-Identifier: Apache-2.0
#include "advise/question.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "hotpath/reference_system/find_chains.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"

namespace hotpath::advise {

namespace {

Graph graph_of(const Options& options) {
  constexpr std::size_t kMostChains = 8;
  Graph graph = setup::graph_to_run(options);
  if (options.cores) graph.platform.cores = *options.cores;
  if (!graph.chains.empty()) return graph;
  graph.chains = find_chains(graph, make_tasks(graph), kMostChains);
  for (const Chain& chain : graph.chains)
    std::cout << "Found " << chain.name << ": " << program::joined(chain.nodes, " -> ") << "\n";
  return graph;
}

}  // namespace

Question::Question(const Options& given, const std::string& usual)
    : options(given),
      graph(graph_of(given)),
      tasks(make_tasks(graph)),
      objective(
          parse_objective(given.objective.value_or(graph.chains.empty() ? "worst_lateness" : usual), graph)),
      folder(setup::output_folder(given, graph)) {
  const double load = mean_load_percent(graph, tasks);
  const unsigned cores = graph.platform.cores;
  if (load < 100.0 * cores) return;
  throw program::OverloadError(
      program::concat("overload: the callbacks of ", graph.name, " need ", program::fixed(load, 0),
                      " % of one core, and there ", cores == 1 ? "is " : "are ", cores,
                      cores == 1 ? " core" : " cores", ": no executor can keep up; give the graph ",
                      std::floor(load / 100) + 1, " cores or more (--cores), or less work (--load)"));
}

std::vector<Candidate> Question::candidates(const std::string& usual) const {
  const std::string costs = options.costs.value_or(usual);
  if (costs != "reference" && costs != "graph")
    throw program::UsageError("--costs: `" + costs + "` is neither reference nor graph");
  program::check_output_folder(folder);
  return make_candidates(graph, objective,
                         {.executors = options.executors,
                          .deployments = options.deployments,
                          .now = options.now,
                          .scheduling = setup::scheduling_of(options, graph, tasks.set, graph.platform.cores),
                          .reference_costs = costs == "reference"});
}

const Candidate& Question::now(const std::vector<Candidate>& candidates) const {
  // A deployment from a file has the name in the file, and is the last candidate.
  const auto named = std::ranges::find(candidates, options.now, &Candidate::name);
  return named == candidates.end() ? candidates.back() : *named;
}

void Question::finish(const nlohmann::json& content) const {
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
  program::show_json(content);
}

}  // namespace hotpath::advise
