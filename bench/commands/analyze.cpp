// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "bounds/bounds.hpp"
#include "commands/commands.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/tightness.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

namespace {

struct AnalyzeOptions {
  std::string graph, trace, csv;
  std::vector<std::string> executors = {"default", "events-ro", "rm-ro", "edf-ro"};
  std::vector<std::string> chain;
  double delta_us = 0;
};

std::string ms(const std::optional<Duration>& d) {
  if (!d) return "-";
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f", to_ms(*d));
  return text;
}

/// Largest observed value of each task and chain of each executor.
struct Observed {
  std::map<std::string, std::map<std::string, Duration>> tasks, chains;
};

void keep_largest(std::map<std::string, Duration>& largest, const std::string& name, Duration value) {
  const auto [at, inserted] = largest.emplace(name, value);
  if (!inserted) at->second = std::max(at->second, value);
}

Observed read_observed(const std::string& folder, const GraphTasks& tasks) {
  Observed observed;
  const std::filesystem::path jobs_file = std::filesystem::path(folder) / "jobs.csv";
  std::ifstream jobs(jobs_file);
  if (!jobs)
    throw UsageError("--trace " + folder + ": there is no readable jobs.csv; give the folder of a run");
  try {
    for (const Trace& trace : read_jobs_csv(jobs, tasks.set, jobs_file.string())) {
      for (const JobRecord& r : trace.jobs) {
        if (r.outcome != Outcome::ran) continue;
        keep_largest(observed.tasks[trace.executor], tasks.set[r.job.task].name, r.finish - r.job.timestamp);
      }
    }
  } catch (const TraceCsvError& error) {
    throw UsageError(error.what());
  }
  std::ifstream chains(std::filesystem::path(folder) / "chains.csv");
  std::string line;
  std::getline(chains, line);
  while (std::getline(chains, line)) {
    std::vector<std::string> field;
    for (std::size_t from = 0; from != std::string::npos;) {
      const std::size_t comma = line.find(',', from);
      field.push_back(line.substr(from, comma == std::string::npos ? comma : comma - from));
      from = comma == std::string::npos ? comma : comma + 1;
    }
    if (field.size() != 6 || field[5].empty()) continue;
    keep_largest(observed.chains[field[0]], field[2], Duration(std::stoll(field[5])));
  }
  return observed;
}

class Report {
 public:
  Report(const Graph& graph, const GraphTasks& tasks, std::optional<Observed> observed, std::ofstream* csv)
      : graph_(graph), tasks_(tasks), observed_(std::move(observed)), csv_(csv) {
    if (csv_ != nullptr) *csv_ << "executor,method,kind,name,bound_ns,observed_ns,tightness,violated\n";
  }

  void print(const BoundSet& set) {
    std::printf("\n%s, %s\n", set.executor.c_str(), set.method.c_str());
    if (!set.refusal.empty()) {
      std::printf("  does not apply: %s\n", set.refusal.c_str());
      return;
    }
    if (!set.tasks.empty()) {
      header("task", "deadline");
      for (TaskId id = 0; id < tasks_.set.size(); ++id) {
        const Task& task = tasks_.set[id];
        const std::optional<Duration> deadline =
            task.kind == TaskKind::timer ? std::optional(task.deadline) : std::nullopt;
        row(set, "task", task.name, set.tasks[id], deadline,
            largest(&Observed::tasks, set.executor, task.name));
      }
      verdict(set);
    }
    if (!set.chains.empty()) {
      header("chain, end to end", "");
      for (std::size_t c = 0; c < set.chains.size(); ++c) {
        const std::string& name = graph_.chains[c].name;
        row(set, "chain", name, set.chains[c], std::nullopt, largest(&Observed::chains, set.executor, name));
      }
    }
  }

  std::size_t violations() const { return violations_; }

 private:
  std::optional<Duration> largest(std::map<std::string, std::map<std::string, Duration>> Observed::*kind,
                                  const std::string& executor, const std::string& name) const {
    if (!observed_) return std::nullopt;
    const auto& by_executor = (*observed_).*kind;
    const auto of_executor = by_executor.find(executor);
    if (of_executor == by_executor.end()) return std::nullopt;
    const auto value = of_executor->second.find(name);
    return value == of_executor->second.end() ? std::nullopt : std::optional(value->second);
  }

  void header(const char* what, const char* deadline) const {
    std::printf("  %-52s %12s %12s", what, "bound ms", deadline);
    if (observed_) std::printf(" %12s %10s", "observed ms", "tightness");
    std::printf("\n");
  }

  void row(const BoundSet& set, const char* kind, const std::string& name, std::optional<Duration> bound,
           std::optional<Duration> deadline, std::optional<Duration> observed) {
    const auto count = [](std::optional<Duration> d) {
      return d ? std::optional<std::int64_t>(d->count()) : std::nullopt;
    };
    const bool comparable = !bound || *bound > Duration::zero();
    const Tightness t = comparable ? compare_with_bounds({{name, count(bound), count(observed)}}).rows.front()
                                   : Tightness{name, count(bound), count(observed), std::nullopt, false};
    violations_ += t.violated;
    std::printf("  %-52s %12s %12s", name.c_str(), ms(bound).c_str(), deadline ? ms(deadline).c_str() : "");
    if (observed_) {
      char ratio[32] = "-";
      if (t.ratio) std::snprintf(ratio, sizeof(ratio), "%.3f", *t.ratio);
      std::printf(" %12s %10s%s", ms(observed).c_str(), ratio, t.violated ? "  VIOLATED" : "");
    }
    std::printf("\n");
    if (csv_ == nullptr) return;
    *csv_ << set.executor << ',' << set.method << ',' << kind << ',' << name << ',';
    if (bound) *csv_ << bound->count();
    *csv_ << ',';
    if (observed) *csv_ << observed->count();
    *csv_ << ',';
    if (t.ratio) *csv_ << *t.ratio;
    *csv_ << ',' << (t.violated ? "yes" : "no") << '\n';
  }

  void verdict(const BoundSet& set) const {
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const Task& task = tasks_.set[id];
      if (task.kind != TaskKind::timer) continue;
      if (!set.tasks[id] || *set.tasks[id] > task.deadline) {
        std::printf("  Not shown schedulable: %s may exceed its deadline.\n", task.name.c_str());
        return;
      }
    }
    std::printf("  Schedulable: every timer meets its deadline.\n");
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::optional<Observed> observed_;
  std::ofstream* const csv_;
  std::size_t violations_ = 0;
};

void print_chain(const AnalyzeOptions& options, const GraphTasks& tasks, const ExecutorEntry& executor) {
  std::string names;
  for (const std::string& name : options.chain) names += (names.empty() ? "" : " -> ") + name;
  std::printf("\n%s, chain %s: largest reaction time and data age\n", std::string(executor.name).c_str(),
              names.c_str());
  const auto bounds = timer_chain_bounds(tasks, executor, from_ms(options.delta_us / 1000), options.chain);
  for (const ChainBound& b : bounds) {
    std::printf("  %-48s %12s%s%s\n", b.method.c_str(), ms(b.latency).c_str(), b.refusal.empty() ? "" : "  ",
                b.refusal.c_str());
  }
  if (bounds.empty()) std::printf("  no published bound covers this executor\n");
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
  if (!options.trace.empty()) observed = read_observed(options.trace, tasks);
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    if (!csv) throw UsageError("--csv " + options.csv + " cannot be written");
  }
  std::printf("%s: load %.1f %% of one core, release overhead delta = %.3f us\n", graph.name.c_str(),
              load_percent(graph), options.delta_us);
  Report report(graph, tasks, std::move(observed), options.csv.empty() ? nullptr : &csv);
  for (const std::string& name : options.executors) {
    const ExecutorEntry& executor = *parse_executor(name, {}).entry;
    if (options.chain.empty()) {
      for (const BoundSet& set : bounds_of(graph, tasks, executor, from_ms(options.delta_us / 1000))) {
        report.print(set);
      }
    } else {
      print_chain(options, tasks, executor);
    }
  }
  if (!options.csv.empty() && !csv.flush()) throw RunError("writing " + options.csv + " failed");
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
