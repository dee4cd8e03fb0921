// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph_writer.hpp"
#include "hotpath/tracing/system.hpp"
#include "import/publication_rules.hpp"

namespace hotpath::imports {

/// The graph of a recorded system, with the mapping between tasks and callbacks of the trace.
struct RecordedGraph {
  Graph graph;  ///< Execution times, chains and platform are not filled in yet.
  GraphTasks tasks;
  std::vector<TaskId> task_of;             ///< By callback; kNoTask: not in the graph.
  std::vector<std::uint32_t> callback_of;  ///< By task; kNone: a timer for publications outside of callbacks.
  std::vector<InferredRule> rules;
  Time epoch{};                    ///< Creation of the first timer: phases count from here.
  std::vector<std::string> notes;  ///< Sentences about differences between the graph and the system.

  /// Names of nodes as in the graph, by node of the trace.
  std::vector<std::string> node_names;

  /// Names of topics as in the graph, and then those of their copies, by topic of the trace.
  std::vector<std::vector<std::string>> topic_names;

  [[nodiscard]] TaskId task(const tracing::JobRef& ref) const {
    return ref.callback < task_of.size() ? task_of[ref.callback] : kNoTask;
  }
};

/// The node whose timers publish what no recorded callback does.
inline constexpr const char* kOutside = "outside";

/// The order in which executors served nodes and callbacks; empty: the order of creation.
struct ServiceOrder {
  std::vector<std::uint32_t> nodes, callbacks;
};

/// `jobs` are in the order of starts. Callbacks that overlapped, or whose `executor_of` (by
/// callback, kNone: unknown) differs, are in different callback groups. Throws UsageError if no
/// task is left for a graph.
[[nodiscard]] RecordedGraph make_recorded_graph(const tracing::System& system,
                                                std::span<const tracing::Job> jobs,
                                                const std::vector<std::uint32_t>& executor_of,
                                                const std::string& name, const ServiceOrder& order = {});

/// The longest and most loaded chains whose data does not all come from outside of the recorded
/// callbacks: of the others no output can have been recorded.
[[nodiscard]] std::vector<Chain> recorded_chains_of(const Graph& graph, const GraphTasks& tasks);

/// Whether every node has the topic, so that graphs leave it out: /rosout, /parameter_events.
[[nodiscard]] bool is_housekeeping(const std::string& topic);

}  // namespace hotpath::imports
