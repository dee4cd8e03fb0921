// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <sstream>

#include "bounds/bounds.hpp"
#include "bounds/timer_chain_bounds.hpp"
#include "commands/commands.hpp"
#include "commands/observed.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/tightness.hpp"
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

std::string ms(const std::optional<Duration>& d) { return d ? fixed(to_ms(*d), 3) : "-"; }

/// The bounds of a graph's tasks and chains, beside what a run observed, if there is one.
class BoundReport {
 public:
  BoundReport(const Graph& graph, const GraphTasks& tasks, std::optional<Observed> observed)
      : graph_(graph), tasks_(tasks), observed_(std::move(observed)) {}

  void print(const BoundSet& set) {
    std::cout << "\n" << set.executor << ", " << set.method << "\n";
    if (!set.refusal.empty()) {
      std::cout << "does not apply: " << set.refusal << "\n";
      return;
    }
    if (!set.tasks.empty()) {
      print_tasks(set);
      print_verdict(set);
    }
    if (!set.chains.empty()) print_chains(set);
  }

  std::size_t violations() const { return violations_; }
  /// Every row so far.
  std::string csv() const {
    return "executor,method,kind,name,bound_ns,observed_ns,tightness,violated\n" + csv_.str();
  }

 private:
  TextTable table(const std::string& what, std::vector<std::string> more) const {
    std::vector<std::string> header = {what, "bound ms"};
    header.insert(header.end(), more.begin(), more.end());
    if (observed_) header.insert(header.end(), {"observed ms", "tightness", ""});
    return TextTable("", std::move(header));
  }

  void print_tasks(const BoundSet& set) {
    TextTable rows = table("task", {"deadline"});
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const Task& task = tasks_.set[id];
      const auto observed = observed_ ? observed_->task(set.executor, task.name) : std::nullopt;
      std::vector<TextTable::Cell> cells = {task.name, ms(set.tasks[id]),
                                            task.kind == TaskKind::timer ? ms(task.deadline) : ""};
      add_row(rows, std::move(cells), set, {"task", task.name, set.tasks[id], observed});
    }
    std::cout << rows;
  }

  void print_chains(const BoundSet& set) {
    TextTable rows = table("chain, end to end", {});
    for (std::size_t c = 0; c < set.chains.size(); ++c) {
      const std::string& name = graph_.chains[c].name;
      const auto observed = observed_ ? observed_->chain(set.executor, name) : std::nullopt;
      add_row(rows, {name, ms(set.chains[c])}, set, {"chain", name, set.chains[c], observed});
    }
    std::cout << rows;
  }

  struct Row {
    const char* kind;
    std::string name;
    std::optional<Duration> bound, observed;
  };

  /// Completes the cells with what was observed.
  void add_row(TextTable& rows, std::vector<TextTable::Cell> cells, const BoundSet& set, const Row& row) {
    const auto count = [](std::optional<Duration> d) {
      return d ? std::optional<std::int64_t>(d->count()) : std::nullopt;
    };
    Tightness t{row.name, count(row.bound), count(row.observed), std::nullopt, false};
    const bool comparable = !row.bound || *row.bound > Duration::zero();
    if (comparable) t = compare_with_bounds({{t.name, t.bound, t.observed}}).rows.front();
    violations_ += t.violated;
    if (observed_) {
      cells.insert(cells.end(), {ms(row.observed), t.ratio ? fixed(*t.ratio, 3) : "-",
                                 t.violated ? "VIOLATED" : ""});
    }
    rows.add_row(std::move(cells));
    const auto field = [&](const auto& value) {
      if (value) csv_ << *value;
      csv_ << ',';
    };
    csv_ << set.executor << ',' << set.method << ',' << row.kind << ',' << row.name << ',';
    field(t.bound);
    field(t.observed);
    field(t.ratio);
    csv_ << (t.violated ? "yes" : "no") << '\n';
  }

  void print_verdict(const BoundSet& set) const {
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const Task& task = tasks_.set[id];
      if (task.kind != TaskKind::timer) continue;
      if (!set.tasks[id] || *set.tasks[id] > task.deadline) {
        std::cout << "Not shown schedulable: " << task.name << " may exceed its deadline.\n";
        return;
      }
    }
    std::cout << "Schedulable: every timer meets its deadline.\n";
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::optional<Observed> observed_;
  std::ostringstream csv_;
  std::size_t violations_ = 0;
};

void print_chain(const AnalyzeOptions& options, const GraphTasks& tasks, const ExecutorEntry& executor) {
  TextTable table(std::string(executor.name) + ", chain " + joined(options.chain, " -> ") +
                      ": largest reaction time and data age",
                  {"method", "ms", "why not"});
  for (const ChainBound& b :
       timer_chain_bounds(tasks, executor, from_ms(options.delta_us / 1000), options.chain)) {
    table.add_row({b.method, ms(b.latency), b.refusal});
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
