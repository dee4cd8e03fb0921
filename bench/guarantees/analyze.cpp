// SPDX-License-Identifier: Apache-2.0
#include "guarantees/analyze.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "bounds/bounds.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "setup/deployed_system.hpp"
#include "setup/stored_system.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::guarantees {

namespace {

class Analysis {
 public:
  Analysis(const AnalyzeOptions& options, std::ostream& out) : options_(options), written_(out) {
    if (!options.trace.empty()) {
      trace_.emplace(options.trace, "--trace");
      take_over_run();
    }
    check_options();
    if (options_.executors.empty() && options_.deployments.empty() && stored_.empty())
      options_.executors = {"default", "events-ro", "rm-ro", "edf-ro"};
    if (!trace_) graph_ = setup::graph_to_run(options_);
    const GraphPlatform platform = graph_.platform;
    options_.apply_to(graph_.platform);
    if (simulated_ && graph_.platform != platform) {
      throw program::UsageError(
          "--trace: the bounds apply to the machine of this simulation; leave out options that change it");
    }
    graph_.platform.delivery_delay = graph_.platform.longest_delivery();
    tasks_ = make_tasks(graph_);
    check_graph();
    if (trace_) observed_.emplace(*trace_, tasks_.set);
  }

  std::vector<BoundRow> run() {
    const std::vector<setup::ExecutorSpec> all =
        stored_.empty() ? setup::executors_to_run(options_, graph_, tasks_) : std::move(stored_);
    std::vector<std::string> labels;
    for (const setup::ExecutorSpec& executor : all) {
      bound(executor);
      labels.push_back(executor.label);
    }
    const bool known = options_.known_phases || !options_.phases_of.empty();
    for (const std::string& sentence : verdict(rows_, labels))
      written_ << program::wrapped(sentence + (known ? " For these phases only." : "")) << "\n";
    written_ << program::text("%s: load %.1f %% of one core, %s\n", graph_.name.c_str(), load_percent(graph_),
                              costs_text().c_str())
             << out_.str();
    const program::Table table = program::table_of(bound_columns(), rows_);
    program::show_json(json_of(table));
    if (!options_.csv.empty()) program::write_output_file(options_.csv, "--csv", csv_of(table));
    if (observed_ && observed_->compared == 0) {
      trace_->fail("no bound covers its tasks under these executors; it ran " +
                   program::joined(trace_->executors(), ", "));
    }
    if (observed_ && observed_->violations > 0) judge();
    return std::move(rows_);
  }

 private:
  /// Bounds the system of the run, with its executors unless others are given.
  void take_over_run() {
    setup::StoredSystem system = setup::stored_system(*trace_, options_.graph);
    simulated_ = system.simulated && (!system.times || system.times->replay.empty());
    const bool others = !options_.executors.empty() || !options_.deployments.empty();
    if (others) system.options.executors = options_.executors;
    if (!others) stored_ = std::move(system.executors);
    system.options.deployments = options_.deployments;
    if (options_.known_phases) system.options.phases = options_.phases;
    system.options.phase_step_ms = options_.phase_step_ms;
    system.options.phases_file = options_.phases_file;
    system.options.phases_of = options_.phases_of;
    static_cast<setup::CommonOptions&>(options_) = std::move(system.options);
    graph_ = std::move(system.graph);
  }

  void check_options() const {
    if (!options_.witness.empty()) {
      program::check_output_folder(options_.witness, "", "--witness");
      if (!options_.known_phases)
        throw program::UsageError("--witness: worst cases are exact for known phases; give --phases");
    }
    if (options_.phase_uncertainty_us && !options_.known_phases)
      throw program::UsageError("--phase-uncertainty-us needs known phases; give --phases");
    if (options_.phase_uncertainty_us && trace_)
      throw program::UsageError("--phase-uncertainty-us excludes --trace; leave one of them out");
  }

  void check_graph() const {
    try {
      bounds::callback_graph(graph_, tasks_, false);
    } catch (const AnalysisError& error) {
      throw program::UsageError("analyze " + options_.graph + ": " + error.what() +
                                "; simulate the graph instead");
    }
  }

  /// Throws UsageError if a repetition of the run had phases that the bounds do not cover.
  void check_phases_of_run(const CallbackGraph& callbacks, const std::string& executor) const {
    if (!trace_ || std::ranges::find(trace_->executors(), executor) == trace_->executors().end()) return;
    for (std::uint32_t r = 0; r < trace_->record().repetitions; ++r) {
      const std::vector<Duration> first = trace_->first_timestamps(callbacks.set, executor, r);
      for (const TaskId a : callbacks.set.timers()) {
        if (callbacks.phases_known && first[a] != callbacks.set[a].phase) {
          trace_->fail("its repetition " + std::to_string(r) + " had other phases than these bounds assume");
        }
        if (callbacks.phases_known) continue;
        for (const TaskId b : callbacks.set.timers()) {
          const Duration apart =
              std::max(Duration::zero(), callbacks.creation_spread - callbacks.set[b].period);
          if (first[a] - first[b] <= callbacks.set[a].period + apart) continue;
          trace_->fail("its timers " + callbacks.set[b].name + " and " + callbacks.set[a].name +
                       " start further apart than bounds for any phases cover; give --phases " +
                       trace_->folder().string());
        }
      }
    }
  }

  std::string costs_text() const {
    std::string text;
    for (const PlatformCost& cost : kPlatformCosts) {
      const Duration value = cost.in(graph_.platform).value_or(Duration::zero());
      if (value > Duration::zero())
        text += (text.empty() ? "" : ", ") + std::string(cost.key) + " " + program::fixed(to_us(value), 3);
    }
    return text.empty() ? "no costs" : text;
  }

  CallbackGraph callbacks_of(const setup::ExecutorSpec& executor) {
    GraphTasks tasks = tasks_;
    bool known = true;
    if (!options_.phases_of.empty()) {
      const results::StoredRun run(options_.phases_of, "--phases");
      setup::set_phases(tasks.set, run.first_timestamps(tasks.set, executor.label, 0));
    } else if (options_.known_phases) {
      setup::set_phases(tasks.set, setup::phases_of_repetition(options_, graph_, tasks, executor, 0));
    } else {
      known = false;
    }
    return bounds::callback_graph(graph_, tasks, known);
  }

  void bound(const setup::ExecutorSpec& executor) {
    const CallbackGraph callbacks = callbacks_of(executor);
    Graph worst = graph_;
    worst.platform.execution_times = ExecutionTimeModel::worst;
    const setup::Utilisation load = setup::utilisation(worst, tasks_, &executor);
    if (!load.warnings.empty()) out_ << "\n" << program::joined(load.warnings, "\n") << "\n";
    check_phases_of_run(callbacks, executor.label);
    const auto premises = setup::premises(graph_, callbacks.set, executor, callbacks.phases_known);
    BoundRow common{.executor = executor.label};
    common.utilisation_percent = load.percent;
    common.rests_on = premises.stated;
    common.assumed = premises.assumed;
    std::vector<bounds::ReachedWorstCase> reached;
    const std::vector<GraphBounds> all = bounds_of(graph_, callbacks, executor, &reached);
    const std::vector<GraphBounds> delivered = delivered_bounds(callbacks, executor);
    const bool any = std::ranges::any_of(all, [](const GraphBounds& b) { return !b.refusal; });
    if (!any) out_ << "\n" << executor.label << ": no bound is known\n";
    for (const GraphBounds& bounds : all) {
      if (!bounds.refusal) {
        show(common, callbacks, bounds, delivered);
      } else if (!any) {
        out_ << "  " << bounds.method << ": " << *bounds.refusal << "\n";
      }
    }
    if (any) {
      out_ << "Rests on: " << common.rests_on << ".\n";
      if (!common.assumed.empty()) out_ << "Assumed, not measured: " << common.assumed << ".\n";
    }
    if (any && explores(callbacks) && all.back().refusal) {
      out_ << (uncertainty() > Duration{} ? "No bounds near these phases: " : "No exact values: ")
           << *all.back().refusal << "\n";
    } else if (any && explores(callbacks) && !delivered.empty() && delivered.back().refusal) {
      out_ << "No exact values with delivery: " << *delivered.back().refusal << "\n";
    }
    if (!options_.witness.empty() && !reached.empty()) {
      GraphTasks tasks = tasks_;
      tasks.set = callbacks.set;
      out_ << write_witnesses(reached, graph_, tasks, executor, options_, options_.witness);
    }
  }

  bool explores(const CallbackGraph& callbacks) const { return callbacks.phases_known || options_.exact; }

  /// The bounds of all methods, and then of an exploration, if there is to be one.
  std::vector<GraphBounds> bounds_of(const Graph& graph, const CallbackGraph& callbacks,
                                     const setup::ExecutorSpec& executor,
                                     std::vector<bounds::ReachedWorstCase>* reached) const {
    CallbackGraph bounded = callbacks;
    if (uncertainty() > Duration{}) {  // of the phases, only their distances are bounded
      bounded.phases_known = false;
      for (const Task& task : bounded.set.tasks)
        bounded.creation_spread = std::max(bounded.creation_spread, task.phase + 2 * uncertainty());
    }
    std::vector<GraphBounds> all = setup::bounds_of(graph, bounded, executor);
    if (explores(callbacks)) all.push_back(exact(graph, callbacks, executor, reached));
    return all;
  }

  /// The same of the system in which samples take kSomeDelivery, if the graph states no delivery.
  std::vector<GraphBounds> delivered_bounds(const CallbackGraph& callbacks,
                                            const setup::ExecutorSpec& executor) const {
    if (graph_.platform.delivery_delay > Duration{} || uncertainty() > Duration{}) return {};
    Graph graph = graph_;
    graph.platform.delivery_delay = kSomeDelivery;
    return bounds_of(graph, callbacks, executor, nullptr);
  }

  void show(const BoundRow& common, const CallbackGraph& callbacks, const GraphBounds& bounds,
            const std::vector<GraphBounds>& delivered) {
    std::vector<BoundRow> rows = bound_rows(common, callbacks, bounds);
    for (const GraphBounds& other : delivered) {
      if (other.refusal || is_exact(other) != is_exact(bounds)) continue;
      for (const BoundRow& of : bound_rows(common, callbacks, other)) {
        const auto row = std::ranges::find_if(
            rows, [&](const BoundRow& r) { return r.latency == of.latency && r.name == of.name; });
        if (row != rows.end() && of.bound_ns)
          row->delivered_ns = std::min(row->delivered_ns.value_or(*of.bound_ns), *of.bound_ns);
      }
    }
    if (observed_) {
      for (BoundRow& row : rows) observed_->compare(row);
    }
    out_ << "\n" << common.executor << ", " << bounds.method << "\n";
    print(out_, rows, observed_.has_value());
    if (!bounds.left_out.empty()) out_ << "No exact " << bounds.left_out << "\n";
    rows_.insert(rows_.end(), rows.begin(), rows.end());
  }

  static bool is_exact(const GraphBounds& bounds) { return bounds.method == bounds::kExactMethod; }

  Duration uncertainty() const { return from_ms(options_.phase_uncertainty_us.value_or(0) / 1000); }

  /// Without `reached`, the values stand beside others, and must not take much longer than those.
  GraphBounds exact(const Graph& graph, const CallbackGraph& callbacks, const setup::ExecutorSpec& executor,
                    std::vector<bounds::ReachedWorstCase>* reached) const {
    const char* const method = uncertainty() > Duration{} ? bounds::kNearPhasesMethod : bounds::kExactMethod;
    if (!callbacks.phases_known)
      return {.method = method, .refusal = "worst cases are exact for known phases only; give --phases"};
    if (!executor.entry) return {.method = method, .refusal = "several executors are not explored"};
    GraphTasks tasks = tasks_;
    tasks.set = callbacks.set;
    const bool many = options_.exact && reached != nullptr;
    const std::size_t most =
        executor.scheduler.workers > 1 ? bounds::kMostStatesOfThreads : bounds::kMostStates;
    // A state with samples on their way has many successors.
    const bool delivered = graph.platform.delivery_delay > Duration{};
    const std::size_t usual = bounds::usual_state_limit(tasks.set) / (delivered && !options_.exact ? 10 : 1);
    const std::size_t limit = many ? most : usual;
    const char* const more = options_.exact ? "" : "; --exact allows more";
    return bounds::exact_worst_cases(graph, tasks, *executor.entry, executor.scheduler,
                                     {limit, uncertainty(), more},
                                     options_.witness.empty() ? nullptr : reached);
  }

  /// Throws RunError if a bound is violated although its assumptions hold.
  void judge() const {
    const std::string share = program::text(
        "%zu of %zu observed values (%.4f %%) exceed their bound, first %s", observed_->violations,
        observed_->compared,
        100.0 * static_cast<double>(observed_->violations) / static_cast<double>(observed_->compared),
        observed_->first_violation.c_str());
    if (simulated_) {
      throw program::RunError("--trace " + options_.trace + ": " + share +
                              ". A bound is wrong; please report the graph " + find_graph(options_.graph) +
                              " and the command that reproduces it: " + trace_->record().command_line());
    }
    written_ << "\n"
             << share
             << ". Bounds assume a dedicated processor, no job longer than its execution time, and the "
             << "platform's costs. A live run can violate these assumptions:\n";
    for (const std::string& warning : trace_->record().warnings) written_ << "  " << warning << "\n";
    if (options_.strict) throw program::RunError("--strict: " + share);
  }

  AnalyzeOptions options_;
  std::ostream& written_;
  std::ostringstream out_;  // what stands below the verdict
  std::optional<results::StoredRun> trace_;
  bool simulated_ = false;  // trace_ meets the bounds' assumptions: virtual time, no job above its worst case
  std::vector<setup::ExecutorSpec> stored_;  // the executors of trace_, unless others are asked for
  Graph graph_;
  GraphTasks tasks_;
  std::optional<Observed> observed_;
  std::vector<BoundRow> rows_;
};

}  // namespace

std::vector<BoundRow> analyze(const AnalyzeOptions& options, std::ostream& out) {
  return Analysis(options, out).run();
}

}  // namespace hotpath::guarantees
