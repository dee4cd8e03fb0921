// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath::commands {

void add_advise_command(CLI::App& app) {
  auto [command, o] = add_command<advise::Options>(
      app, "advise", "Predict the best executor and deployment for a graph by simulation",
      "hotpath advise autoware --cores 2 --for hot_path:p99 --draws 20", advise::advise);
  o.phases = Phases::random;
  o.duration_s = 10;
  o.warm_up_s = 1;
  add_graph_options(command, o);
  CLI::App& advise = command;
  advise.remove_option(advise.get_option("--work"));  // for live runs only
  advise.add_option("GRAPH", o.graph, "Alias of --graph")->type_name("");
  exclude(advise, "GRAPH", {"--graph"});
  advise.option_defaults()->group("Objective and candidates");
  add_text(advise, "--for", o.objective, "OBJECTIVE",
           "CHAIN:median, CHAIN:p99 or CHAIN:worst, such as hot_path:p99;\n"
           "CHAIN<MS, several separated by commas; worst_lateness; losses");
  add_text(advise, "--now", o.now, "NAME", "Current executor or deployment, the baseline");
  add_cores_option(advise, o.cores);
  add_text(advise, "--costs", o.costs, "reference|graph",
           "Costs of executors: measured for each on the reference\n"
           "machine, or those of the graph's platform for all");
  add_list(advise, "--executors", o.executors, "NAMES",
           "Candidates besides --deployments, separated by commas;\nby default all that suit the graph");
  add_deployments_option(advise, o);
  advise.option_defaults()->group(kDurationGroup);
  add_number(advise, "--draws", o.draws, {1, 10000}, "N", "Random draws of phases and execution times");
  add_number(advise, "--budget", o.budget_s, {0.1, 1e6}, "SECONDS",
             "Time limit of all simulations; reduces the draws to fit");
  add_number(advise, "--duration", o.duration_s, {0.1, 1e5}, "SECONDS", "Simulated time of each draw");
  add_warm_up_option(advise, o);
  add_number(advise, "--seed", o.seed, kAnySeed, "N", "Seed of all draws");
  advise.option_defaults()->group("Results");
  add_threads_option(advise, o.threads);
  add_output_option(advise, o);
}

}  // namespace hotpath::commands
