// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/chain_age.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/registry.hpp"

namespace hotpath {

/// The system to analyse: a graph under an executor on a platform.
struct BoundedSystem {
  const CallbackGraph& graph;
  const ExecutorEntry& executor;
  SchedulerOptions scheduling;
  Platform platform;
};

/// The bounds of one method, in nanoseconds.
struct GraphBounds {
  std::string method;  ///< Author and year, or the name in docs/analysis.md.
  /// Worst-case response time of each task, from its timestamp; std::nullopt: no bound. Empty if
  /// the method does not apply.
  std::vector<std::optional<std::int64_t>> tasks = {};
  /// Parallel to the graph's chains. Empty if the method does not bound chains.
  std::vector<std::optional<ChainAge>> chains = {};
  std::vector<std::string> no_chain_bound = {};  ///< Parallel to `chains`: the reason for a missing bound.
  /// The assumptions that the method does not cover, and a method that does; none if it applies.
  std::optional<std::string> refusal = {};
  std::string left_out = {};  ///< What the method bounds for other systems, and why not here; empty: nothing.
  std::map<TaskId, PathParts> parts = {};  ///< Components of the timers' bounds, if the method gives them.
};

/// A property of a system that a method must cover to be applicable.
enum class Assumption : std::uint32_t {
  subscriptions = 1U << 0,
  fixed_priorities = 1U << 1,
  deadlines = 1U << 2,
  activation_order = 1U << 3,
  polling = 1U << 4,             ///< A wait set, timers before subscriptions.
  other_order = 1U << 5,         ///< Any other order that never idles.
  runs_timers = 1U << 6,         ///< The timer management thread runs timers.
  several_threads = 1U << 7,     ///< Several threads that run jobs.
  ties_by_activation = 1U << 8,  ///< The order among jobs of equal priority, if such jobs may exist.
  unknown_phases = 1U << 9,
  shifted_phases = 1U << 10,  ///< Phases are known, and some timer has a phase other than 0.
  costs = 1U << 11,           ///< Costs of dispatches and waits.
  wake_up = 1U << 12,
  late_releases = 1U << 13,  ///< The timer thread waits for the executor thread on the only core.
  delivery_delay = 1U << 14,
  mixed_deadlines = 1U << 15,  ///< A job may run under another deadline than that of its sample.
  /// The end of a job returns its timer to the timer thread, which may have to wake up.
  woken_by_jobs = 1U << 16,
  any_delivery = 1U << 17,    ///< Samples of a topic reach its subscriptions in any order.
  release_jitter = 1U << 18,  ///< Timers' jobs become ready later than at their timestamps.
  /// A service that has waited for SchedulerOptions::service_wait runs next.
  service_wait = 1U << 19,
  release_costs = 1U << 20,
};

constexpr std::uint32_t bits(std::initializer_list<Assumption> all) {
  std::uint32_t sum = 0;
  for (const Assumption a : all) sum |= static_cast<std::uint32_t>(a);
  return sum;
}
/// Whichever of the ready jobs an executor runs next.
inline constexpr std::uint32_t kAnyOrder = bits(
    {Assumption::fixed_priorities, Assumption::deadlines, Assumption::activation_order, Assumption::polling,
     Assumption::other_order, Assumption::ties_by_activation, Assumption::mixed_deadlines});

/// The properties of the system, as bits of Assumption, from its tasks and what is known of phases and
/// delivery. Each method states the bits that it covers; a system with any other bit is refused.
[[nodiscard]] std::uint32_t assumptions_of(const BoundedSystem& system);

/// The reason why a method does not apply: the uncovered assumptions `missing`.
[[nodiscard]] std::string not_covered(std::uint32_t missing);

/// The bounds of every method. `also_covers`: bits that no method checks, for tests which prove
/// that the check is needed.
[[nodiscard]] std::vector<GraphBounds> graph_bounds(const BoundedSystem& system,
                                                    std::uint32_t also_covers = 0);

}  // namespace hotpath
