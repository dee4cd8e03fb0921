// SPDX-License-Identifier: Apache-2.0
#include "validation/prediction.hpp"

#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath {

Prediction predict(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec& executor,
                   const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up) {
  std::vector<ChainObservation> observations;
  GraphWorkload workload(graph, tasks, times, &observations);
  Prediction p;
  p.trace = simulate_trace(tasks.set, *executor.entry, executor.scheduler, workload, options);
  p.latencies_ms.resize(graph.chains.size());
  for (const ChainObservation& o : observations) {
    if (o.sink_start < Time{} + warm_up) continue;
    p.latencies_ms[o.chain].push_back(to_ms(o.sink_start - o.latest_source_start));
  }
  return p;
}

Schedule predict_timers(const TaskSet& set, const ExecutorEntry& executor, Platform platform,
                        Duration duration) {
  platform.wall_clock_work = true;
  const WorstCaseTimes times(set);
  PublishingWorkload workload(times);
  SimulationOptions options;
  options.platform = platform;
  options.duration = duration;
  return schedule_of(set, simulate_trace(set, executor, {}, workload, options));
}

}  // namespace hotpath
