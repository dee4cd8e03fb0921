// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

void add_advise_command(CLI::App& app) {
  auto [command, o] = add_command<AdviseOptions>(
      app, "advise", "Predict which executor and deployment would serve a graph best",
      "hotpath advise autoware --cores 2 --for hot_path:p99 --draws 20", advise);
  o.phases = Phases::random;
  o.duration_s = 10;
  o.warm_up_s = 1;
  add_graph_options(command, o);
  CLI::App& advise = command;
  advise.remove_option(advise.get_option("--work"));  // it is of live runs
  advise.add_option("GRAPH", o.graph, "The same as --graph")->type_name("GRAPH");
  exclude(advise, "GRAPH", {"--graph"});
  advise.option_defaults()->group("What is asked");
  add_text(advise, "--for", o.objective, "WHAT",
           "hot_path:median, :p99, :worst, or of another chain;\nCHAIN<MS, several with commas between; "
           "worst_lateness;\nlosses");
  add_text(advise, "--now", o.now, "NAME", "Executor or deployment that the system has today");
  add_number(advise, "--cores", o.cores, {1, kMaxWorkers}, "N",
             "Processor cores; by default as the graph's platform says");
  add_text(advise, "--costs", o.costs, "reference|graph",
           "What executors cost: on the reference machine, each its\nown; or as the graph's platform says, "
           "all the same");
  add_list(advise, "--executors", o.executors, "NAMES",
           "Only these, with commas between, and --deployments;\nby default all that suit the graph");
  add_deployments_option(advise, o);
  advise.option_defaults()->group(kHowLong);
  add_number(advise, "--draws", o.draws, {1, 10000}, "N", "Draws of phases and execution times");
  add_number(advise, "--budget", o.budget_s, {0.1, 1e6}, "SECONDS",
             "Time for all; fewer draws where it does not suffice");
  add_number(advise, "--duration", o.duration_s, {0.1, 1e5}, "SECONDS", "Simulated time of each draw");
  add_number(advise, "--warm-up", o.warm_up_s, {0, 3600}, "SECONDS",
             "Time before that, whose latencies do not count");
  add_number(advise, "--seed", o.seed, kAnySeed, "N", "Decides all draws");
  advise.option_defaults()->group("Results");
  add_number(advise, "--threads", o.threads, {0, 1024}, "N",
             "Simulations at the same time, 0 for one per processor;\nresults do not depend on it");
  add_output_option(advise, o);
}

}  // namespace hotpath
