// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>

#include "bounds/timer_chain_bounds.hpp"
#include "commands/bound_report.hpp"
#include "commands/commands.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

namespace {

struct AnalyzeOptions {
  std::string graph, trace, csv;
  std::vector<std::string> executors = {"default", "events-ro", "rm-ro", "edf-ro"};
  std::vector<std::string> chain;
  double delta_us = 0;
};

void print_chain(const AnalyzeOptions& options, const GraphTasks& tasks, const ExecutorEntry& executor) {
  TextTable table(std::string(executor.name) + ", chain " + joined(options.chain, " -> ") +
                      ": largest reaction time and data age",
                  {"method", "ms", ""});
  for (const ChainBound& b :
       timer_chain_bounds(tasks, executor, from_ms(options.delta_us / 1000), options.chain)) {
    table.add_row({b.method, in_ms(b.latency), b.refusal});
  }
  std::cout << "\n" << table;
  if (table.empty()) std::cout << "no published bound covers this executor\n";
}

void analyze(const AnalyzeOptions& options) {
  const Graph graph = load_graph(find_graph(options.graph));
  GraphTasks tasks = make_tasks(graph);
  const bool all_phases = std::all_of(graph.nodes.begin(), graph.nodes.end(),
                                      [](const Node& n) { return n.period == Duration::zero() || n.phase; });
  if (all_phases) {
    const std::vector<Duration> phases = make_phases(graph, tasks, Phases::given);
    for (TaskId id = 0; id < tasks.set.size(); ++id) tasks.set.tasks[id].phase = phases[id];
  }
  std::optional<Observed> observed;
  if (!options.trace.empty()) observed.emplace(options.trace, tasks.set);
  std::printf("%s: load %.1f %% of one core, release overhead delta = %.3f us\n", graph.name.c_str(),
              load_percent(graph), options.delta_us);
  BoundReport report(graph, tasks, std::move(observed));
  for (const std::string& name : options.executors) {
    const ExecutorEntry& executor = *parse_executor(name, {}).entry;
    if (!options.chain.empty()) {
      print_chain(options, tasks, executor);
      continue;
    }
    for (const BoundSet& set : bounds_of(graph, tasks, executor, from_ms(options.delta_us / 1000))) {
      report.print(set);
    }
  }
  if (!options.csv.empty()) write_whole_file(options.csv, "--csv", report.csv());
  if (report.violations() > 0) {
    std::printf(
        "\n%zu observed values exceed their bound. The bounds assume one processor to itself, no job longer "
        "than its execution time, and delta per release: a loaded or virtual machine breaks that.\n",
        report.violations());
  }
}

}  // namespace

void add_analyze_command(CLI::App& app) {
  auto options = std::make_shared<AnalyzeOptions>();
  CLI::App* command =
      app.add_subcommand("analyze", "What theory guarantees: worst-case response times and latencies");
  command->add_option("GRAPH", options->graph, "Name of a graph (`hotpath list graphs`) or path of a file")
      ->required();
  command->add_option("--executors", options->executors, "Names separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--delta-us", options->delta_us, "Release overhead of one timer in microseconds")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  auto* trace =
      command->add_option("--trace", options->trace, "Folder of a run of this graph: observed against bound");
  command->add_option("--chain", options->chain, "Timers separated by commas: bounds of the chain they form")
      ->delimiter(',')
      ->excludes(trace);
  command->add_option("--csv", options->csv, "Also write the table to this file");
  command->callback([options] {
    try {
      analyze(*options);
    } catch (const AnalysisError& error) {
      throw UsageError(error.what());
    }
  });
}

}  // namespace hotpath
