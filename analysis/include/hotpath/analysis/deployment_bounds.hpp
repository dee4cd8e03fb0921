// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/graph_bounds.hpp"

namespace hotpath {

/// One executor of a deployment, as the operating system schedules its threads.
struct DeployedThread {
  std::string name;
  const ExecutorEntry* executor = nullptr;
  SchedulerOptions scheduling;
  int priority = 0;                  ///< SCHED_FIFO: 1 to 99, larger first; 0: the ordinary scheduling class.
  int timers_priority = 0;           ///< Of its timer management thread, if it has one.
  std::string other_policy;          ///< A real-time policy that is not SCHED_FIFO; empty: none.
  std::vector<unsigned> processors;  ///< That its threads may use; at least one.
};

/// A graph whose tasks are distributed over executors.
struct DeployedSystem {
  const CallbackGraph& graph;
  std::vector<DeployedThread> threads;
  std::vector<std::uint32_t> thread_of;  ///< By task: its executor in `threads`.
  Platform platform;
};

/// The bounds for executor threads under SCHED_FIFO that are each bound to one processor
/// (docs/chain_bounds.md, "Several threads"): preemptive fixed priorities between the threads of a processor,
/// each executor's order within its thread, and samples from other processors as timers with jitter, to a
/// fixed point. Tasks of the ordinary scheduling class have no bound. All other systems are refused.
[[nodiscard]] GraphBounds deployment_bounds(const DeployedSystem& system);

}  // namespace hotpath
