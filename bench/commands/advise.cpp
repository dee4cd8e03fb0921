// SPDX-License-Identifier: Apache-2.0
#include "advise/advice.hpp"
#include "commands/command.hpp"
#include "watch/contract.hpp"

namespace hotpath::commands {

namespace {

/// Makes `--phases` without a value, or with the word `chosen`, choose the phases.
void choose_phases_option(CLI::App& advise, advise::Options& o) {
  advise.remove_option(advise.get_option("--phases"));
  const std::string alone = "chosen";
  const auto set = [&o, alone](const std::string& text) {
    o.choose_phases = text == alone;
    set_phases(o, o.choose_phases ? to_string(Phases::creation) : text);
  };
  advise
      .add_option_function<std::string>("--phases", set,
                                        in_lines("Timer phases of all draws; by default random. Without a "
                                                 "value: choose the phases with the best guaranteed --for"))
      ->expected(0, 1)
      ->type_name(concat("[", phase_words(), "|FILE|", alone, "]"))
      ->default_str(alone)  // what CLI11 passes for an option without a value
      ->group(kSystemGroup);
  add(advise, "--margin", o.margin_ms, {0, 1e6}, "MS",
      "With --phases without a value: how far offsets may be off, by default\n"
      "1 % of the shortest period")
      ->group(kSystemGroup);
}

bool is_reference(const std::string& text) {
  if (text == "reference" || text == "graph") return text == "reference";
  throw UsageError("--costs: `" + text + "` is neither reference nor graph");
}

}  // namespace

const Command kAdvise("Your robot", 110, [](CLI::App& app) {
  auto [command, o] = add_command<advise::Options>(
      app, "advise", "Predict the best executor and deployment for a graph by simulation",
      "hotpath advise autoware --cores 2 --for hot_path:age:p99 --repetitions 20",
      [](const advise::Options& options) {
        if (options.choose_phases) return advise::advise_phases(options);
        if (options.margin_ms)
          throw UsageError("--margin is for phases that are chosen; add --phases without a value");
        advise::advise(options);
      });
  o.contract = [](const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor) {
    return watch::contract_text(watch::stated_contract(graph, tasks, executor));
  };
  o.phases = Phases::random;
  o.duration_s = 10;
  o.warm_up_s = 1;
  add_graph_options(command, o);
  CLI::App& advise = command;
  advise.remove_option(advise.get_option("--work"));  // for live runs only
  choose_phases_option(advise, o);
  advise.option_defaults()->group("Objective and candidates");
  add(advise, "--for", o.objective, "OBJECTIVE",
      "CHAIN:age:STATISTIC (median, p99 or worst): age of the data, from the oldest source's timestamp to "
      "the output's finish; CHAIN:STATISTIC: hot-path latency, from the latest source's start to the sink's "
      "(the paper's metric); CHAIN<MS, several separated by commas: limits of the worst age; worst_lateness; "
      "losses; by default CHAIN:age:p99 of the first chain, with --phases without a value CHAIN:age:worst");
  add(advise, "--now", o.now, "NAME", "Current executor or deployment, the baseline");
  add_cores_option(advise, o.cores);
  add_parsed(advise, "--costs", o.reference_costs, is_reference, "reference|graph",
             "Costs of executors: measured for each on the reference machine, or those of the graph's "
             "platform for all; by default reference, with --phases without a value graph");
  add_list(advise, "--executors", o.executors, "NAMES",
           "Candidates besides --deployments, separated by commas;\nby default all that suit the graph");
  add_deployments_option(advise, o);
  advise.option_defaults()->group(kDurationGroup);
  add(advise, "--repetitions", o.draws, {1, 10000}, "N", "Random draws of phases and execution times");
  add(advise, "--time-out", o.budget_s, {0.1, 1e6}, "SECONDS",
      "Time limit of all simulations; reduces the draws to fit");
  add(advise, "--duration", o.duration_s, {0.1, 1e5}, "SECONDS", "Simulated time of each draw");
  add_warm_up_option(advise, o);
  add(advise, "--seed", o.seed, kAnySeed, "N", "Seed of all draws");
  advise.option_defaults()->group("Results");
  add_threads_option(advise, o.threads);
  add_output_option(advise, o);
  add_json_option(advise);
  show_first(command, {"--for", "--now", "--executors", "--deployments", "--cores", "--output"});
});

}  // namespace hotpath::commands
