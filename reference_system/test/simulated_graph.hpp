// SPDX-License-Identifier: Apache-2.0
// Runs of graphs in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hotpath/core/accounting.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath {

struct Simulated {
  GraphTasks tasks;
  Trace trace;
  std::vector<ChainObservation> observations;

  /// The start times of a task's jobs, in milliseconds.
  std::vector<double> starts(const std::string& task) const {
    std::vector<double> starts;
    for (const JobRecord& r : trace.jobs)
      if (r.outcome == Outcome::ran && tasks.set[r.job.task].name == task)
        starts.push_back(to_ms(r.start - Time{}));
    return starts;
  }
};

/// `phases`: first timestamps of the timers, by task; missing ones are 0.
inline Simulated simulate_graph(const Graph& graph, const std::string& executor, Duration duration,
                                const std::vector<Duration>& phases = {},
                                const SchedulerOptions& scheduling = {}) {
  const ExecutorEntry& entry = *find_executor(executor);
  Simulated s;
  s.tasks = make_tasks(graph);
  for (TaskId id = 0; id < phases.size(); ++id) s.tasks.set.tasks[id].phase = phases[id];
  const WorstCaseTimes times(s.tasks.set);
  GraphWorkload workload(graph, s.tasks, times, &s.observations);
  SimulationOptions options;
  options.platform = make_platform(graph, entry);
  options.duration = duration;
  s.trace = simulate_trace(s.tasks.set, entry, scheduling, workload, options);
  s.trace.chains = join_chains(graph, s.tasks, s.trace, s.observations);
  for (const TaskAccount& account : account(s.tasks.set, s.trace))
    EXPECT_TRUE(account.balanced()) << s.tasks.set[account.task].name;
  return s;
}

}  // namespace hotpath
