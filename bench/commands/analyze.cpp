// SPDX-License-Identifier: Apache-2.0
#include "guarantees/analyze.hpp"
#include "bounds/bounds.hpp"
#include "commands/command.hpp"
#include "watch/contract.hpp"

namespace hotpath::commands {

namespace {

struct AnalyzeArguments : guarantees::AnalyzeOptions {
  std::string contract;
  std::optional<double> margin_percent;
};

constexpr double kMargin = 50;

void analyze(const AnalyzeArguments& arguments) {
  program::catch_interrupts();
  if (arguments.margin_percent && (arguments.contract.empty() || arguments.trace.empty()))
    throw UsageError("--margin is for a contract of recorded values; give --contract and --trace too");
  const bool recorded = !arguments.trace.empty();
  std::string contract;
  if (!arguments.contract.empty())
    contract = watch::contract_text(
        recorded ? watch::recorded_contract(arguments, arguments.margin_percent.value_or(kMargin))
                 : watch::stated_contract(arguments));
  // A recorded system need not have bounds.
  if (contract.empty() || !recorded) guarantees::analyze(arguments, std::cout);
  if (!contract.empty()) program::write_output_file(arguments.contract, "--contract", contract);
}

}  // namespace

void add_analyze_options(CLI::App& command, guarantees::AnalyzeOptions& o) {
  o.graph.clear();  // no default
  add(command, "GRAPH,--graph", o.graph, "NAME", kGraphHelp)->required();
  add_list(command, "--executors", o.executors, "NAMES",
           "Executors (`hotpath list executors`), separated by commas, with variants such as rm-ro:first; by "
           "default default,events-ro,rm-ro,edf-ro, or those of --trace");
  add_deployments_option(command, o);
  add_scaling_options(command, o);
  add_phases_option(command, o,
                    "Bounds for these timer phases only; by default for any. RUN: those of the same "
                    "executor's first repetition in a stored run",
                    &o.known_phases);
  add(command, "--phase-uncertainty-us", o.phase_uncertainty_us, {0, 1e9}, "US",
      "Bounds for phases that are off by up to this much, for each timer by the same time in all jobs");
  add(command, "--exact", o.exact,
      concat("Explore up to ", bounds::kMostStates, " states instead of up to ", bounds::kUsualStates,
             " for the exact\nworst cases, which known phases have under executors with one\n"
             "thread that runs jobs"));
  add(command, "--witness", o.witness, "FOLDER",
      "Store a simulated run that reaches each exact worst case in\na subfolder of this folder");
  add_entity_order_option(command, o);
  auto* trace =
      add(command, "--trace", o.trace, "RUN", "Folder of a run of this graph, to compare with the bounds");
  add(command, "--strict", o.strict, "Exit with code 1 also if a live run exceeds a bound")->needs(trace);
  add_output_file(command, "--csv", o.csv, "Also write the table as CSV");
  add_json_option(command);
  add_platform_options(command, o);
  command.get_option("--phase-uncertainty-us")->excludes("--witness");
  // The run determines these options.
  command.get_option("--trace")->excludes("--set", "--load", "--rate", "--copies", "--entity-order");
}

const Command kAnalyze("Predict", 50, [](CLI::App& app) {
  auto [command, o] = add_command<AnalyzeArguments>(
      app, "analyze", "Compute worst-case bounds on response times and latencies",
      "hotpath analyze autoware --executors fp-ro,default", analyze);
  add_analyze_options(command, o);
  add_output_file(command, "--contract", o.contract,
                  "Also write the contract that `hotpath watch` checks, for any phases and one executor; "
                  "with --trace, write only that of the recorded run");
  add(command, "--margin", o.margin_percent, {0, 1000}, "PERCENT",
      concat("By which limits of --contract exceed the worst values of\n--trace; by default ", kMargin));
  show_first(command, {"--executors", "--set", "--cores", "--phases", "--trace", "--contract"});
  command.get_option("--contract")->excludes("--phases", "--exact", "--phase-uncertainty-us");
});

}  // namespace hotpath::commands
