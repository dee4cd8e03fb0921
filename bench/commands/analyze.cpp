// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <optional>
#include <string>

#include "bounds/exact_worst_cases.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "guarantees/analyze.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "watch/stated_contract.hpp"

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
    throw program::UsageError(
        "--margin is for a contract of recorded values; give --contract and --trace too");
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
  add_graph_option(command, o.graph)->required();
  add_list(command, "--executors", o.executors, "NAMES",
           "Executors (`hotpath list executors`), separated by commas,\n"
           "with variants such as rm-ro:first; by default\n"
           "default,events-ro,rm-ro,edf-ro, or those of --trace");
  add_deployments_option(command, o);
  add_scaling_options(command, o);
  add_phases_option(command, o,
                    "Bounds for these timer phases only; by default for any. RUN:\n"
                    "those of the same executor's first repetition in a stored run",
                    &o.known_phases);
  add_number(
      command, "--phase-uncertainty-us", o.phase_uncertainty_us, {0, 1e9}, "US",
      "Bounds for phases that are off by up to this much, for each\ntimer by the same time in all jobs");
  command.add_flag("--exact", o.exact,
                   program::concat("Explore up to ", bounds::kMostStates, " states instead of up to ",
                                   bounds::kUsualStates, " for the exact\n") +
                       "worst cases, which known phases have under executors with one\n"
                       "thread that runs jobs");
  add_text(command, "--witness", o.witness, "FOLDER",
           "Store a simulated run that reaches each exact worst case in\na subfolder of this folder");
  add_entity_order_option(command, o);
  auto* trace = add_text(command, "--trace", o.trace, "RUN",
                         "Folder of a run of this graph, to compare with the bounds");
  command.add_flag("--strict", o.strict, "Exit with code 1 also if a live run exceeds a bound")->needs(trace);
  add_output_file(command, "--csv", o.csv, "Also write the table as CSV");
  add_json_option(command);
  add_platform_options(command, o);
  exclude(command, "--phase-uncertainty-us", {"--witness"});
  // The run determines these options.
  exclude(command, "--trace", {"--set", "--load", "--rate", "--copies", "--entity-order"});
}

void add_analyze_command(CLI::App& app) {
  auto [command, o] = add_command<AnalyzeArguments>(
      app, "analyze", "Compute worst-case bounds on response times and latencies",
      "hotpath analyze autoware --executors fp-ro,default", analyze);
  add_analyze_options(command, o);
  add_output_file(command, "--contract", o.contract,
                  "Also write the contract that `hotpath watch` checks, for any\nphases and one executor; "
                  "with --trace, write only that of the\nrecorded run");
  add_number(command, "--margin", o.margin_percent, {0, 1000}, "PERCENT",
             program::concat("By which limits of --contract exceed the worst values of\n--trace; by default ",
                             kMargin));
  show_first(command, {"--executors", "--set", "--cores", "--phases", "--trace", "--contract"});
  exclude(command, "--contract", {"--phases", "--exact", "--phase-uncertainty-us"});
}

const Command kAnalyze("Predict", 50, add_analyze_command);

}  // namespace hotpath::commands
