// SPDX-License-Identifier: Apache-2.0
#include "simulated/repetition.hpp"

#include <algorithm>
#include <optional>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "results/measures.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::simulated {

namespace {

/// Measures jobs and keeps none of them but, of those at both ends of chains, the ends.
class RunTotals final : public JobSink {
 public:
  RunTotals(const Plan& plan, const GraphTasks& tasks)
      : counted_from_(Time{} + plan.warm_up),
        chains_(index_chains(plan.graph, tasks), tasks.set.size()),
        measures_(tasks.set, counted_from_, counted_from_ + plan.duration, false) {}

  void started(const JobRecord& record) override { chains_.add_start(record); }
  void ended(const JobRecord& record) override {
    chains_.add_end(record);
    measures_.add(record);
  }

  void add_to(results::Repetition& repetition, const std::vector<ChainObservation>& observations) {
    for (const ChainObservation& o : observations) {
      const std::optional<Time> timestamp = chains_.sink_timestamp(o.sink);
      if (!timestamp || *timestamp >= counted_from_) repetition.trace.chains.push_back(chains_.join(o));
    }
    repetition.measures = measures_.result();
  }

 private:
  const Time counted_from_;
  ChainJoin chains_;
  results::JobMeasures measures_;
};

}  // namespace

results::Repetition simulate_repetition(const Plan& plan, bool keeps_jobs) {
  GraphTasks tasks = plan.tasks;
  tasks.set = with_releases(std::move(tasks.set), plan.times);
  const TaskSet& set = tasks.set;
  const System system(plan.executor, plan.graph, tasks);
  std::vector<ChainObservation> observations;
  GraphWorkload workload(plan.graph, tasks, plan.times, &observations);
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
  std::optional<RunTotals> totals;
  if (!keeps_jobs) totals.emplace(plan, tasks);
  JobSink& sink = totals ? static_cast<JobSink&>(*totals) : recorder;
  SimulationSummary summary =
      simulate(set, system.executors(), system.executor_of(), workload, options, &sink);
  trace.executor = plan.executor.label;
  trace.end = summary.end;
  trace.published = std::move(summary.published);
  repetition.expected = expected_jobs(set, trace);
  if (totals) {
    totals->add_to(repetition, observations);
  } else {
    trace.chains = join_chains(plan.graph, plan.tasks, trace, observations);
  }
  trace.chains = results::counted_chains(trace, Time{} + plan.warm_up);
  return repetition;
}

std::unique_ptr<ExecutionTimes> with_drawn_releases(std::unique_ptr<ExecutionTimes> times,
                                                    const GraphTasks& tasks, std::uint64_t seed) {
  if (tasks.set.has_release_jitter()) times->set_releases(std::make_unique<UniformReleases>(tasks.set, seed));
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
