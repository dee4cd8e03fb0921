// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/chain_age.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/registry.hpp"

namespace hotpath {

/// What there is to be bounded: a graph under an executor on a platform.
struct BoundedSystem {
  const CallbackGraph& graph;
  const ExecutorEntry& executor;
  SchedulerOptions scheduling;
  Platform platform;
};

/// What one method guarantees, nanoseconds.
struct GraphBounds {
  std::string method;  ///< Author and year, or what docs/analysis.md calls it.
  /// Worst-case response time of each task, from its timestamp; none: no bound. Empty: the method refuses.
  std::vector<std::optional<std::int64_t>> tasks;
  std::vector<std::optional<ChainAge>>
      chains;                               ///< Parallel to the graph's chains. Empty: not a method for them.
  std::vector<std::string> no_chain_bound;  ///< Parallel to `chains`: why there is none.
  std::string refusal;                ///< What it does not cover, and which method does; empty: it applies.
  std::map<TaskId, PathParts> parts;  ///< What the bounds of timers consist of, if the method knows.
};

/// Something about a system that a method must cover to be applied to it.
enum class Assumption : std::uint32_t {
  subscriptions = 1U << 0,
  fixed_priorities = 1U << 1,
  deadlines = 1U << 2,
  activation_order = 1U << 3,
  polling = 1U << 4,             ///< A wait set, timers before subscriptions.
  other_order = 1U << 5,         ///< Anything else that never idles.
  runs_timers = 1U << 6,         ///< The timer management thread runs timers.
  several_threads = 1U << 7,     ///< That run jobs.
  ties_by_activation = 1U << 8,  ///< Among jobs of equal priority, and there may be some.
  unknown_phases = 1U << 9,
  shifted_phases = 1U << 10,  ///< Phases are known, and some timer's is not 0.
  costs = 1U << 11,           ///< Of releases, dispatches and waits.
  wake_up = 1U << 12,
  late_releases = 1U << 13,  ///< The timer thread waits for the executor thread on the only core.
  delivery_delay = 1U << 14,
  mixed_deadlines = 1U << 15,  ///< A job may not run by the deadline of the sample that it takes.
  woken_by_jobs = 1U << 16,  ///< A timer thread gets a timer back when its job ends, and may have to wake up.
};

/// What holds of the system, as bits of Assumption.
[[nodiscard]] std::uint32_t assumptions_of(const BoundedSystem& system);

/// What each method says of the system. `also_covers`: bits that no method checks, for tests that the check
/// is needed.
[[nodiscard]] std::vector<GraphBounds> graph_bounds(const BoundedSystem& system,
                                                    std::uint32_t also_covers = 0);

/// The exact worst case of timers, and of chains along sequences of subscriptions, for the phases that
/// `system.graph` has: by the schedule-abstraction graph (Nasri 2017), one predecessor a job. Subscriptions
/// have no bounds of their own.
[[nodiscard]] GraphBounds exact_bounds(const BoundedSystem& system, std::uint32_t also_covers = 0);

/// End-to-end latency of data that a chain of timers, each of which reads what the one before wrote last,
/// hands on: its largest reaction time and data age.
struct TimerChainBound {
  std::string method;
  std::optional<std::int64_t> latency;  ///< Nanoseconds.
  std::string refusal;
};

/// What each method says of the chain of the timers `names`. Throws AnalysisError for an unknown name.
[[nodiscard]] std::vector<TimerChainBound> timer_chain_bounds(const BoundedSystem& system,
                                                              const std::vector<std::string>& names,
                                                              std::uint32_t also_covers = 0);

}  // namespace hotpath
