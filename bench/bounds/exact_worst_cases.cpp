// SPDX-License-Identifier: Apache-2.0
#include "bounds/exact_worst_cases.hpp"

#include <algorithm>

#include "hotpath/core/exploration.hpp"
#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath {

namespace {

/// Keeps the worst of what an exploration meets.
class WorstCases final : public ExplorationObserver {
 public:
  WorstCases(const Graph& graph, const GraphTasks& tasks, GraphBounds& bounds)
      : tasks_(tasks), chains_(index_chains(graph, tasks)), bounds_(bounds) {
    bounds_.tasks.resize(tasks.set.size());
    bounds_.chains.resize(chains_.size());
    bounds_.no_chain_bound.assign(chains_.size(), "no data of its sources ever reach its sink");
    tracked_.resize(tasks.set.size());
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      for (const TaskId source : chains_[c].sources) {
        if (tasks.set[source].kind != TaskKind::timer) {
          bounds_.no_chain_bound[c] = tasks.set[source].name + " begins it and is no timer";
          chains_[c].sources.clear();
          break;
        }
        tracked_[source] = true;
      }
      for (const TaskId sink : chains_[c].sink_tasks) tracked_[sink] = true;
    }
  }

  [[nodiscard]] const std::vector<bool>& tracked() const { return tracked_; }
  [[nodiscard]] std::vector<ChainObservation>* observations() { return &observations_; }

  void ended(const JobRecord& record, const ExploredInstant& instant) override {
    if (record.outcome != Outcome::ran || !is_of_timer(record.job)) return;
    std::optional<std::int64_t>& worst = bounds_.tasks[record.job.task];
    worst = std::max(worst.value_or(0), (instant.latest() - record.job.timestamp).count());
  }

  void published(const ExploredInstant& instant) override {
    for (const ChainObservation& observation : observations_) add(observation, instant);
    observations_.clear();
  }

 private:
  void add(const ChainObservation& observation, const ExploredInstant& instant) {
    const std::vector<TaskId>& sources = chains_[observation.chain].sources;
    Time oldest = kNever;
    Duration hot_path = Duration::max();
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if ((observation.sources_seen >> i & 1U) == 0) continue;
      const Task& timer = tasks_.set[sources[i]];
      const auto sequence = static_cast<std::int64_t>(observation.source_sequence[i]);
      oldest = std::min(oldest, Time{} + timer.phase + timer.period * sequence);
      // One thread ran one source's job after the other: the latest is the same in all schedules.
      hot_path = std::min(
          hot_path, instant.longest_between({sources[i], observation.source_sequence[i]}, observation.sink));
    }
    if (oldest == kNever) return;
    std::optional<ChainAge>& worst = bounds_.chains[observation.chain];
    if (!worst) worst.emplace();
    worst->latency = std::max(worst->latency, (instant.latest() - oldest).count());
    worst->response = worst->latency;
    worst->hot_path = std::max(worst->hot_path.value_or(0), hot_path.count());
    worst->sink = observation.sink.task;
  }

  const GraphTasks& tasks_;
  std::vector<ChainIndex> chains_;
  GraphBounds& bounds_;
  std::vector<bool> tracked_;
  std::vector<ChainObservation> observations_;
};

}  // namespace

GraphBounds exact_worst_cases(const Graph& graph, const GraphTasks& tasks, const ExecutorEntry& executor,
                              const SchedulerOptions& scheduling, std::size_t max_states) {
  GraphBounds bounds;
  bounds.method = "exploration: exact for these phases";
  try {
    WorstCases worst(graph, tasks, bounds);
    const WorstCaseTimes times(tasks.set);
    const GraphWorkload workload(graph, tasks, times, worst.observations());
    ExplorationOptions options;
    options.platform = make_platform(graph, executor);
    options.tracked = worst.tracked();
    options.max_states = max_states;
    explore(tasks.set, *executor.make(tasks.set, scheduling), workload, options, worst);
  } catch (const ExplorationRefused& error) {
    bounds = {};
    bounds.method = "exploration: exact for these phases";
    bounds.refusal = error.what();
  }
  return bounds;
}

}  // namespace hotpath
