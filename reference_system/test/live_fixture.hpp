// SPDX-License-Identifier: Apache-2.0
// Live systems with one executor.
#pragma once

#include "hotpath/live/clock.hpp"
#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath {

/// The tasks of a graph with these first timestamps.
inline GraphTasks tasks_with(const Graph& graph, Phases phases) {
  GraphTasks tasks = make_tasks(graph);
  const std::vector<Duration> first = make_phases(graph, tasks, phases);
  for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
  return tasks;
}

/// A system of the process's own that is connected, and the memory into which it records.
struct ConnectedSystem {
  ConnectedSystem(const Graph& graph, const GraphTasks& tasks, const std::string& executor,
                  TransportKind transport)
      : memory({tasks.set.size(), worker_count(*find_executor(executor), {}), 10'000, 1'000}),
        system(graph, tasks, options(*find_executor(executor), transport), memory) {
    system.wait_until_matched(now() + std::chrono::seconds(20));
  }

  RunMemory memory;
  LiveSystem system;

 private:
  static LiveOptions options(const ExecutorEntry& entry, TransportKind transport) {
    LiveOptions o;
    o.executors = {{&entry, {}, default_options(entry)}};
    o.transport = transport;
    o.fastdds.partition = "reference_system_test";
    o.calibration.divisions_per_us = 300;
    return o;
  }
};

}  // namespace hotpath
