// SPDX-License-Identifier: Apache-2.0
#include "simulated/simulated_run.hpp"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "hotpath/analysis/parallel.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "results/run_folder.hpp"
#include "results/stored_run.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"
#include "setup/setup_facts.hpp"
#include "setup/utilisation.hpp"
#include "simulated/own_times.hpp"
#include "simulated/repetition.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::simulated {

namespace {

using nlohmann::json;

/// The run of `--execution-times replay:RUN`.
std::optional<results::StoredRun> replayed_run(const Options& options) {
  if (!options.execution_times || options.execution_times->replay.empty()) return std::nullopt;
  if (options.load_given)
    throw program::UsageError("--load: --execution-times replay: takes the load of its run; leave one out");
  return results::StoredRun(options.execution_times->replay, kReplayOption);
}

/// The options with the load of a replayed run, so that worst cases are its own.
Options with_load(Options options, const std::optional<results::StoredRun>& replayed) {
  if (replayed) options.load_given = replayed->record().load_given;
  return options;
}

/// The graph to run, with the options' changes to its platform.
Graph simulated_graph(const Options& options) {
  Graph graph = setup::graph_to_run(options);
  GraphPlatform& p = graph.platform;
  options.apply_to(p);
  if (options.execution_times) p.execution_times = options.execution_times->model.value_or(p.execution_times);
  return graph;
}

/// In the order of the options of the command, which gives its own run the same run.json.
std::vector<std::string> words_of(const Options& o) {
  using program::concat, program::joined, program::text;
  const std::string step = o.phase_step_ms ? text(":%.15g", *o.phase_step_ms) : "";
  std::vector<std::string> words = {
      "simulate",
      o.deployments.empty() ? "--executors=" + joined(o.executors, ",")
                            : "--deployments=" + joined(o.deployments, ","),
      "--graph=" + o.graph,
      "--phases=" + (o.phases_file.empty() ? to_string(o.phases) + step : o.phases_file)};
  if (o.entity_order != setup::EntityOrder{}) words.push_back("--entity-order=" + o.entity_order.text());
  words.insert(words.end(), {text("--duration=%.15g", o.duration_s), text("--warm-up=%.15g", o.warm_up_s),
                             concat("--seed=", o.seed)});
  if (o.execution_times) words.push_back("--execution-times=" + o.execution_times->text());
  return words;
}

class SimulatedRun {
 public:
  explicit SimulatedRun(const Options& options)
      : replayed_(replayed_run(options)),
        options_(with_load(options, replayed_)),
        graph_(simulated_graph(options_)),
        times_(options_.execution_times.value_or(setup::TimesSource{graph_.platform.execution_times})),
        tasks_(make_tasks(graph_)),
        executors_(setup::executors_to_run(options_, graph_, tasks_, graph_.platform.cores)),
        counting_(setup::summary_options(options_, graph_)) {
    prepare();
  }

  /// Throws OverloadError if an executor is overloaded; with `partial`, if all are.
  results::Summary summary(bool partial = false) {
    simulate_all();
    reject_overload(partial);
    results::Summary summary = results::summarize(tasks_.set, runs_, counting_);
    for (std::size_t i = 0; i < simulations_.size(); ++i)
      summary.executors[i / options_.repetitions].overload = simulations_[i].overload;
    return summary;
  }

  void run() {
    program::check_output_folder(setup::output_folder(options_.output, graph_.name));
    program::end_on_interrupt("hotpath: interrupted; the simulation was stopped, and nothing was stored\n");
    const results::Summary all = summary(true);
    program::catch_interrupts();  // from here on, the run is stored whole
    std::vector<std::string> notes = setup::idle_options(options_, executors_);
    notes.insert(notes.end(), warnings_.begin(), warnings_.end());
    for (const std::string& sentence : notes) std::cerr << "note: " << sentence << "\n";
    results::RunFolder folder(setup::output_folder(options_.output, graph_.name));
    store(all, folder);
    folder.show([&] {
      results::write_table(std::cout, all, results::Detail::short_answer);
      const std::string path = folder.path().string();
      std::cout << "\nNext: hotpath explain " << path << " --worst  # why the oldest output is so old\n"
                << "      hotpath report " << path << "           # a page with every output and timer\n";
      if (options_.repetitions == 1)
        std::cout << "      the same with --phases random --repetitions 20   # other phases\n";
      if (!graph_.chains.empty()) program::draw_figure("hot-path", folder.path());
    });
    program::show_json(all);
  }

  void store() {
    results::RunFolder folder(setup::output_folder(options_.output, graph_.name));
    store(summary(), folder);
  }

 private:
  struct Simulation {
    GraphTasks tasks;  ///< With the phases of this repetition.
    results::Repetition* repetition = nullptr;
    std::string overload = {};  ///< Why it has no result; empty: it has one.
  };

  void prepare() {
    if (!options_.phases_of.empty()) phases_of_.emplace(options_.phases_of, "--phases");
    if (replayed_) replayed_->load(tasks_.set);
    for (const setup::ExecutorSpec& e : executors_) {
      runs_.push_back({e.label, std::vector<results::Repetition>(options_.repetitions)});
      std::ranges::move(setup::utilisation(graph_, tasks_, &e).warnings, std::back_inserter(warnings_));
    }
    simulations_.resize(executors_.size() * options_.repetitions);
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
      simulations_[i].tasks = tasks_;
      simulations_[i].repetition = &runs_[i / options_.repetitions].repetitions[repetition(i)];
      setup::set_phases(simulations_[i].tasks.set, first_timestamps(executor(i), repetition(i)));
      // Throws before anything runs, if a system is impossible or a measurement is missing.
      [[maybe_unused]] const System system(executor(i), graph_, tasks_);
      execution_times(i);
    }
    if (options_.no_trace) return;
    setup::check_trace_memory(options_, tasks_, simulations_.size(), 0,
                              "a shorter --duration, fewer --repetitions, or --no-trace");
  }

  /// Whether execution times or releases depend on the seed.
  bool draws() const {
    return times_.model.value_or(ExecutionTimeModel::worst) != ExecutionTimeModel::worst ||
           tasks_.set.has_release_jitter();
  }

  const setup::ExecutorSpec& executor(std::size_t i) const { return executors_[i / options_.repetitions]; }
  std::uint32_t repetition(std::size_t i) const {
    return static_cast<std::uint32_t>(i % options_.repetitions);
  }

  std::vector<Duration> first_timestamps(const setup::ExecutorSpec& e, std::uint32_t r) const {
    if (phases_of_) return phases_of_->first_timestamps(tasks_.set, e.label, r);
    return setup::phases_of_repetition(options_, graph_, tasks_, e, r);
  }

  std::unique_ptr<ExecutionTimes> execution_times(std::size_t i) const {
    if (replayed_) {
      return times_of_run(*replayed_, tasks_, executor(i).label, repetition(i),
                          options_.seed + repetition(i));
    }
    if (!times_.listed.empty()) return listed_times(times_.listed, tasks_.set);
    return execution_times_of(graph_, tasks_, options_.seed + repetition(i));
  }

  void simulate_one(std::size_t i) {
    Simulation& simulation = simulations_[i];
    const setup::ExecutorSpec& e = executor(i);
    const auto times = execution_times(i);
    Plan plan{e, graph_, simulation.tasks, *times};
    plan.warm_up = counting_.warm_up;
    plan.duration = from_s(options_.duration_s);
    plan.max_backlog = options_.max_backlog;
    try {
      *simulation.repetition = simulate_repetition(plan, !options_.no_trace);
    } catch (const SimulationError& error) {
      simulation.overload = error.what();
      simulation.repetition->trace.executor = e.label;
    }
    simulation.repetition->trace.repetition = repetition(i);
  }

  /// Each simulation depends on its index alone, so threads may take them in any order.
  void simulate_all() {
    for_each_index(simulations_.size(), options_.threads, [this](std::size_t i) { simulate_one(i); });
  }

  /// An executor has results of all repetitions or of none: the others would make it look better than it is.
  void reject_overload(bool partial) {
    std::string first;
    std::size_t count = 0;
    for (std::size_t e = 0; e < executors_.size(); ++e) {
      const auto all = std::span(simulations_).subspan(e * options_.repetitions, options_.repetitions);
      const auto of = std::ranges::find_if(all, [](const Simulation& s) { return !s.overload.empty(); });
      if (of == all.end()) continue;
      const std::string cause = of->overload;
      if (count++ == 0) first = "executor `" + executors_[e].label + "`: " + cause;
      for (Simulation& s : all) s.overload = cause;
      rejected_.push_back(std::move(runs_[e].repetitions));  // simulations_ points to them
    }
    if (count == executors_.size() || (count > 0 && !partial)) throw program::OverloadError(first);
  }

  /// Contains neither date nor machine, so that the same input gives the same bytes.
  results::RunRecord describe() const {
    results::RunRecord record = setup::record_of(options_, graph_, tasks_.set, executors_);
    record.kind = results::RunKind::simulated;
    record.simulation = results::SimulationRecord{.platform = graph_.platform,
                                                  .execution_times = times_.text(),
                                                  .max_backlog = options_.max_backlog,
                                                  .no_trace = options_.no_trace,
                                                  .drawn = draws()};
    record.bounds = setup::timer_bounds(graph_, tasks_, executors_);
    record.warnings = warnings_;
    return record;
  }

  void store(const results::Summary& summary, results::RunFolder& folder) {
    results::RunRecord record = describe();
    setup::keep_inputs(folder, options_, graph_, record, times_.listed);
    folder.write("run.json", json(record));
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
      const Simulation& s = simulations_[i];
      if (s.overload.empty()) folder.append(s.tasks.set, counting_.chains, s.repetition->trace);
      record.runs.push_back(results::record_of(s.tasks.set, counting_.chains, *s.repetition));
      record.runs.back().failure = s.overload;
      if (!s.overload.empty() && repetition(i) == 0)
        record.failures.push_back(executor(i).label + ": " + s.overload);
    }
    folder.close(record, json(summary));
  }

  std::optional<results::StoredRun> replayed_;
  Options options_;
  const Graph graph_;
  const setup::TimesSource times_;
  const GraphTasks tasks_;
  const std::vector<setup::ExecutorSpec> executors_;
  const results::SummaryOptions counting_;
  std::optional<results::StoredRun> phases_of_;
  std::vector<results::ExecutorRuns> runs_;
  std::vector<std::vector<results::Repetition>> rejected_;
  std::vector<std::string> warnings_;
  std::vector<Simulation> simulations_;  // executor by executor, repetition by repetition
};

}  // namespace

void run_simulated(const Options& options) { SimulatedRun(options).run(); }

void store_simulation(Options options) {
  if (options.command.empty()) options.command = words_of(options);
  SimulatedRun(options).store();
}

results::Summary summary_of_simulation(const Options& options) { return SimulatedRun(options).summary(); }

void check_simulation(const Options& options) { const SimulatedRun checked(options); }

}  // namespace hotpath::simulated
