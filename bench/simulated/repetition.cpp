// SPDX-License-Identifier: Apache-2.0
#include "simulated/repetition.hpp"

#include <algorithm>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "simulated/run_totals.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::simulated {

results::Repetition simulate_repetition(const Plan& plan, RunTotals* totals) {
  GraphTasks tasks = plan.tasks;
  tasks.set = with_releases(std::move(tasks.set), plan.times);
  const TaskSet& set = tasks.set;
  const System system(plan.executor, plan.graph, tasks);
  std::vector<ChainObservation> observations;
  GraphWorkload workload(plan.graph, plan.tasks, plan.times, &observations);
  SimulationOptions options;
  options.platform = make_platform(plan.graph, *setup::parts(plan.executor).front().entry);
  options.duration = plan.warm_up + plan.duration;
  options.start = plan.start;
  options.overload_backlog = 100 * static_cast<std::uint64_t>(set.size());
  options.deliveries = plan.times.deliveries();
  if (plan.max_backlog) options.overload_backlog = options.max_backlog = *plan.max_backlog;

  results::Repetition repetition;
  Trace& trace = repetition.trace;
  TraceRecorder recorder(trace);
  JobSink& sink = totals != nullptr ? static_cast<JobSink&>(*totals) : recorder;
  SimulationSummary summary =
      simulate(set, system.executors(), system.executor_of(), workload, options, &sink);
  trace.executor = plan.executor.label;
  trace.end = summary.end;
  trace.published = std::move(summary.published);
  repetition.accounts = account(set, trace);
  if (totals != nullptr) {
    totals->count(repetition.accounts);
    for (const ChainObservation& o : observations) {
      if (!totals->early(o.sink)) trace.chains.push_back(totals->chains().join(o));
    }
  } else {
    trace.chains = join_chains(plan.graph, plan.tasks, trace, observations);
  }
  trace.chains = results::counted_chains(trace, Time{} + plan.warm_up);
  return repetition;
}

std::unique_ptr<ExecutionTimes> with_drawn_releases(std::unique_ptr<ExecutionTimes> times,
                                                    const GraphTasks& tasks, std::uint64_t seed) {
  const auto varies = [](const Task& task) { return task.release_jitter > Duration{}; };
  if (std::ranges::any_of(tasks.set.tasks, varies))
    times->set_releases(std::make_unique<UniformReleases>(tasks.set, seed));
  return times;
}

namespace {

std::unique_ptr<ExecutionTimes> times_of(const Graph& graph, const GraphTasks& tasks, std::uint64_t seed) {
  const ExecutionTimeModel model = graph.platform.execution_times;
  switch (model) {
    case ExecutionTimeModel::worst:
      break;
    case ExecutionTimeModel::uniform:
      return std::make_unique<UniformTimes>(tasks.set, seed);
    case ExecutionTimeModel::measured:
    case ExecutionTimeModel::replayed: {
      std::vector<MeasuredTimes::Values> values;
      for (const Callback& callback : tasks.callbacks) values.push_back(callback.measured);
      return std::make_unique<MeasuredTimes>(
          tasks.set, std::move(values), seed,
          model == ExecutionTimeModel::replayed ? Draw::in_order : Draw::independent);
    }
  }
  return std::make_unique<WorstCaseTimes>(tasks.set);
}

}  // namespace

std::unique_ptr<ExecutionTimes> execution_times_of(const Graph& graph, const GraphTasks& tasks,
                                                   std::uint64_t seed) {
  return with_drawn_releases(times_of(graph, tasks, seed), tasks, seed);
}

}  // namespace hotpath::simulated
