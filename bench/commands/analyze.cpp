// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>

#include "bounds/bounds.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/analysis/tightness.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#include "results/measures.hpp"
#include "results/stored_run.hpp"

namespace hotpath {

namespace {

/// `-` for none.
std::string in_ms(const std::optional<Duration>& d) { return d ? fixed(to_ms(*d), 3) : "-"; }

/// By kind (`task` or `chain`), executor and name: the largest response time or end-to-end latency that a run
/// observed.
using Observed = std::map<std::array<std::string, 3>, Duration>;

/// Throws UsageError, which names `--trace`, for what is not the folder of a run of these tasks.
Observed observe(const std::string& folder, const TaskSet& set) {
  Observed largest;
  const auto keep = [&](const std::array<std::string, 3>& key, Duration value) {
    largest[key] = std::max(largest[key], value);
  };
  StoredRun run(folder, "--trace");
  run.load(set);
  for (const Trace& trace : run.traces()) {
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome == Outcome::ran) keep({"task", trace.executor, set[r.job.task].name}, response_time(r));
    }
    for (const ChainRecord& c : trace.chains) {
      if (c.end_to_end_latency < Duration::zero()) continue;  // unknown
      keep({"chain", trace.executor, run.chains()[c.chain]}, c.end_to_end_latency);
    }
  }
  return largest;
}

/// The bounds of a graph's tasks and chains, beside what a run observed, if there is one.
class BoundReport {
 public:
  /// Graph and tasks must outlive it.
  BoundReport(const Graph& graph, const GraphTasks& tasks, std::optional<Observed> observed)
      : graph_(graph), tasks_(tasks), observed_(std::move(observed)) {}

  /// To standard output.
  void print(const BoundSet& set) {
    std::cout << "\n" << set.executor << ", " << set.method << "\n";
    if (!set.refusal.empty()) {
      std::cout << "does not apply: " << set.refusal << "\n";
      return;
    }
    if (!set.tasks.empty()) {
      TextTable rows = table("task", {"deadline"});
      for (TaskId id = 0; id < tasks_.set.size(); ++id) {
        const Task& task = tasks_.set[id];
        const std::string deadline = task.kind == TaskKind::timer ? in_ms(task.deadline) : "";
        add_row(rows, {task.name, in_ms(set.tasks[id]), deadline}, set, "task", set.tasks[id]);
      }
      std::cout << rows;
      print_verdict(set);
    }
    if (set.chains.empty()) return;
    TextTable rows = table("chain, end to end", {});
    for (std::size_t c = 0; c < set.chains.size(); ++c) {
      add_row(rows, {graph_.chains[c].name, in_ms(set.chains[c])}, set, "chain", set.chains[c]);
    }
    std::cout << rows;
  }

  /// Observed values that exceed their bound.
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

  /// A row that begins with the cells.
  void add_row(TextTable& rows, std::vector<TextTable::Cell> cells, const BoundSet& set,
               const std::string& kind, std::optional<Duration> bound) {
    const auto count = [](std::optional<Duration> d) {
      return d ? std::optional<std::int64_t>(d->count()) : std::nullopt;
    };
    std::optional<Duration> observed;
    if (observed_) {
      const auto found = observed_->find({kind, set.executor, cells.front().value});
      if (found != observed_->end()) observed = found->second;
    }
    Tightness t{cells.front().value, count(bound), count(observed), std::nullopt, false};
    const bool comparable = !bound || *bound > Duration::zero();
    if (comparable) t = compare_with_bounds({{t.name, t.bound, t.observed}}).rows.front();
    violations_ += t.violated;
    if (observed_) {
      cells.insert(cells.end(),
                   {in_ms(observed), t.ratio ? fixed(*t.ratio, 3) : "-", t.violated ? "VIOLATED" : ""});
    }
    rows.add_row(std::move(cells));
    write_row(csv_, set.executor, set.method, kind, t.name, t.bound, t.observed, t.ratio,
              t.violated ? "yes" : "no");
  }

  void print_verdict(const BoundSet& set) const {
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const Task& task = tasks_.set[id];
      if (task.kind != TaskKind::timer || (set.tasks[id] && *set.tasks[id] <= task.deadline)) continue;
      std::cout << "Not shown schedulable: " << task.name << " may exceed its deadline.\n";
      return;
    }
    std::cout << "Schedulable: every timer meets its deadline.\n";
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::optional<Observed> observed_;
  std::ostringstream csv_;
  std::size_t violations_ = 0;
};

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
  if (const auto refusal = refusal_of(graph)) {
    throw UsageError("analyze " + options.graph + ": " + *refusal + "; simulate the graph instead");
  }
  GraphTasks tasks = make_tasks(graph);
  const bool all_phases =
      std::ranges::all_of(graph.nodes, [](const Node& n) { return n.period == Duration::zero() || n.phase; });
  if (all_phases) set_phases(tasks.set, make_phases(graph, tasks, Phases::given));
  std::optional<Observed> observed;
  if (!options.trace.empty()) observed = observe(options.trace, tasks.set);
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
  auto [command, o] = add_command<AnalyzeOptions>(
      app, "analyze", "What theory guarantees: worst-case response times and latencies", "", analyze);
  command.add_option("GRAPH", o.graph, "Name of a graph (`hotpath list graphs`) or path of a file")
      ->required();
  command.add_option("--executors", o.executors, "Names separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  command.add_option("--delta-us", o.delta_us, "Release overhead of one timer in microseconds")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  auto* trace =
      command.add_option("--trace", o.trace, "Folder of a run of this graph: observed against bound");
  command.add_option("--chain", o.chain, "Timers separated by commas: bounds of the chain they form")
      ->delimiter(',')
      ->excludes(trace);
  command.add_option("--csv", o.csv, "Also write the table to this file");
}

}  // namespace hotpath
