// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/core/exploration.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath::bounds {

/// A chain whose age is bounded. A chain that begins inside other chains is none.
struct BoundedChain : ChainIndex {
  std::uint32_t number = 0;  ///< In the graph.
};
/// In the order of GraphBounds::chains.
[[nodiscard]] std::vector<BoundedChain> bounded_chains(const Graph& graph, const GraphTasks& tasks);

/// The graph in the form that the analyses take. With `phases_known` it has the phases of the task
/// set. Throws AnalysisError for nodes of type callbacks whose publication rules no method covers.
CallbackGraph callback_graph(const Graph& graph, const GraphTasks& tasks, bool phases_known);

/// The smallest bound that a method gives.
struct Guarantee {
  std::int64_t ns = 0;
  std::string method;
};

/// What theory guarantees for a graph under one executor: for any phases, unless a method says for which.
/// By latency, and name of the task or chain.
struct Guarantees : std::map<std::pair<Latency, std::string>, Guarantee> {
  /// std::nullopt also if the chain does not begin in timers.
  [[nodiscard]] std::optional<Guarantee> of(Latency latency, const std::string& name) const {
    const auto known = find({latency, name});
    return known == end() ? std::nullopt : std::optional(known->second);
  }
};

/// The smallest of the bounds of all methods; std::nullopt if no method covers the system.
[[nodiscard]] std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                                    const std::vector<GraphBounds>& all_bounds);

/// GraphBounds::method.
inline constexpr const char* kExactMethod = "exploration: exact for these phases";
/// With ExactOptions::phase_uncertainty.
inline constexpr const char* kNearPhasesMethod = "exploration: bound near these phases";

struct ExactOptions {
  std::size_t max_states = 100'000;
  /// > 0: upper bounds for phases up to this much earlier or later, each the same for all jobs of its timer.
  Duration phase_uncertainty{};
  const char* more_states = "";  ///< How to allow more states, added to a refusal at their limit.
};

/// A worst case, and a schedule that reaches it.
struct ReachedWorstCase {
  Latency latency = Latency::response;
  std::uint32_t number = 0;  ///< Of the task, or of the chain in the graph.
  std::int64_t value_ns = 0;
  Witness witness;
};

/// The most states of an exploration: without a limit of its own, and with `hotpath analyze --exact`; those
/// of several threads take several times the time and memory, about 20 s and 1 GB.
inline constexpr std::size_t kUsualStates = 50'000, kMostStates = 1'000'000, kMostStatesOfThreads = 150'000;

/// The limit of states without `--exact`. A state takes time in proportion to the tasks: the limit keeps an
/// executor below a second.
[[nodiscard]] inline std::size_t usual_state_limit(const TaskSet& set) {
  constexpr std::size_t kUsualStatesOfAllTasks = 20 * kUsualStates;
  return std::min(kUsualStates, kUsualStatesOfAllTasks / set.size());
}

/// The exact worst cases of one executor thread for the phases that `tasks` has and any execution times
/// between the best and the worst case of each task, and any releases up to `release_jitter` late: response
/// times, and age of data and hot-path latency of chains that begin in timers
/// (executor/src/core/exploration.cpp). A refusal says what is not covered, or what ended the
/// exploration: `max_states`, half of the memory, or a signal. `reached`, if given, gets a witness of each.
[[nodiscard]] GraphBounds exact_worst_cases(const Graph& graph, const GraphTasks& tasks,
                                            const ExecutorEntry& executor, const SchedulerOptions& scheduling,
                                            const ExactOptions& exact = {},
                                            std::vector<ReachedWorstCase>* reached = nullptr);

}  // namespace hotpath::bounds
