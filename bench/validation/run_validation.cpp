// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "hotpath/core/csv.hpp"
#include "hotpath/reference_system/graph_scaling.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"
#include "setup/stored_system.hpp"
#include "simulated/own_times.hpp"
#include "simulated/repetition.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

namespace {

namespace fs = std::filesystem;

constexpr double kSameLoad_percent = 2;
/// The reference's crunch of 4.22 ms at 190 crunches a second.
constexpr double kReferenceLoad_percent = 80.2;

/// Hot-path latencies of a graph's first chain in one repetition.
std::vector<double> latencies_ms(const Trace& trace) {
  std::vector<double> latencies;
  for (const ChainRecord& r : trace.chains) {
    if (r.chain == 0) latencies.push_back(to_ms(r.hot_path_latency));
  }
  return latencies;
}

/// Compares a run with simulations of its phases and execution times, and with the reference.
class ValidatedRun {
 public:
  ValidatedRun(const fs::path& run, const fs::path& reference)
      : reference_(reference),
        measured_(run, "RUN"),
        system_(setup::stored_system(measured_)),
        chains_(setup::measured_chains(system_.graph, system_.tasks)) {
    measured_.load(system_.tasks.set);
  }

  std::vector<RunValidation> validate() const {
    std::vector<RunValidation> all;
    for (const Trace& trace : measured_.traces()) all.push_back(validate(trace));
    return all;
  }

 private:
  /// For a live run, the platform has its number of processors and the costs seen in its gaps.
  Graph graph_of(const Trace& trace) const {
    Graph graph = system_.graph;
    if (measured_.record().simulation) return graph;
    graph.platform.cores = measured_.record().cores();
    const simulated::OwnCosts costs = simulated::own_costs(trace, graph.platform.cores);
    graph.platform.set_dispatch_costs(costs.dispatch);
    graph.platform.wake_up = costs.wake_up;
    return graph;
  }

  results::Repetition simulate_again(const Trace& trace, const Graph& graph, const GraphTasks& tasks,
                                     const setup::ExecutorSpec& executor) const {
    const auto times = simulated::times_again(measured_, system_, tasks, trace.executor, trace.repetition);
    simulated::Plan plan{executor, graph, tasks, chains_, *times};
    plan.warm_up = measured_.warm_up();
    plan.duration = measured_.length() - measured_.warm_up();
    // For a live run an overload is a valid result.
    plan.max_backlog = system_.simulated ? system_.backlog : SimulationOptions{}.max_backlog;
    try {
      return simulated::simulate_repetition(plan);
    } catch (const SimulationError& error) {
      throw program::RunError(
          program::concat(measured_.folder().string(), ": ", trace.executor, ": ", error.what()));
    }
  }

  RunValidation validate(const Trace& trace) const {
    const GraphTasks tasks = system_.tasks_of(measured_, trace.executor, trace.repetition);
    const setup::ExecutorSpec& executor =
        measured_.check([&]() -> const setup::ExecutorSpec& { return system_.executor(trace.executor); });
    const Graph graph = graph_of(trace);
    const Trace simulated = simulate_again(trace, graph, tasks, executor).trace;
    const results::Schedule schedule = results::schedule_of(tasks.set, trace);
    RunValidation v{
        measured_.folder().string(),
        trace.executor,
        trace.repetition,
        {{"dispatch", to_us(graph.platform.timer_dispatch_cost)}, {"wake_up", to_us(graph.platform.wake_up)}},
        compare_schedules(schedule, results::schedule_of(tasks.set, simulated)),
        {},
        {}};
    const std::vector<double> measured = latencies_ms(trace);
    if (!measured.empty()) {
      v.latencies = {latency_quantiles(measured), latency_quantiles(latencies_ms(simulated)), {}, {}, {}};
      v.latencies->median = compare_medians(v.latencies->measured_ms, v.latencies->simulated_ms, 0.05);
      add_real_latencies(*v.latencies, trace.executor, tasks.set);
    } else if (executor.entry != nullptr) {
      v.golden = against_golden(reference_, graph.name, schedule, *executor.entry);
    }
    return v;
  }

  /// Adds the real stack's latencies, for unchanged Autoware at the same load.
  void add_real_latencies(RunLatencies& latencies, const std::string& label, const TaskSet& set) const {
    const Graph& graph = system_.graph;
    if (graph.name != "autoware" || system_.options.copies > 1 || system_.options.rate_percent) return;
    if (std::abs(load_percent(graph) - kReferenceLoad_percent) > kSameLoad_percent) return;
    const fs::path file = reference_ / "rclcpp_autoware_phases.csv";
    for (CsvReader row(file); row.next();) {
      // The reference writes `rm-ro (first)` for `rm-ro:first`.
      const std::string reference_label(row.text("executor"));
      std::string name = reference_label;
      const bool subscriptions_first = name.ends_with(" (first)");
      if (subscriptions_first) name.resize(name.find(' '));
      const bool ours_first = label.ends_with(":first") || system_.options.rule == SubscriptionRule::first;
      if (results::ExecutorLabel(label).name != name || subscriptions_first != ours_first) continue;
      latencies.real_ms = real_latencies(row);
      latencies.phases_differ_ms =
          largest_phase_difference_ms(set, read_phases(file, graph, reference_label));
      return;
    }
  }

  const fs::path reference_;
  results::StoredRun measured_;
  const setup::StoredSystem system_;
  const std::vector<results::MeasuredChain> chains_;
};

}  // namespace

std::vector<RunValidation> validate_run(const fs::path& run, const fs::path& reference) {
  return ValidatedRun(run, reference).validate();
}

}  // namespace hotpath::validation
