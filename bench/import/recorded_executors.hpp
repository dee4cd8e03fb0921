// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath {

/// Threads that share callbacks, and the executors to which they may belong.
struct RecordedExecutor {
  std::string name;
  std::uint32_t process = 0;            ///< Id of its process.
  std::vector<std::uint32_t> threads;   ///< Threads that ran callbacks, as indices into the system's threads.
  std::vector<std::string> candidates;  ///< Labels as on the command line, the likeliest first; >= 1.
  std::string why;                      ///< The evidence in the trace.
};

struct RecordedExecutors {
  std::vector<RecordedExecutor> executors;
  std::vector<std::uint32_t> of_callback;  ///< By callback; kNone: no thread ran it.
};

/// Callbacks that ran on one thread share an executor. `given`: the executor, if the user knows it.
[[nodiscard]] RecordedExecutors recorded_executors(const tracing::System& system, const std::string& given);

/// The processors on which at least one in a hundred of a thread's jobs ended.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const tracing::Thread& thread);

/// A measured cost.
struct MeasuredCost {
  std::size_t n = 0;
  Duration median{}, p90{};
};

/// The costs of an executor, from the gaps between the jobs of its threads.
struct RecordedCosts {
  MeasuredCost dispatch;  ///< End of a job to the start of the next ready job of the same snapshot.
  MeasuredCost wait;      ///< The same with a new wait between them, without the dispatch.
  MeasuredCost wake_up;   ///< Release of a job to its start on a thread that slept, without the dispatch.
  MeasuredCost delivery;  ///< The same for subscriptions only, from the publication.
};

/// Jobs of a recording and their records, in the order of starts.
struct RecordedWindow {
  std::span<const tracing::Job> jobs;  ///< Of all callbacks.
  std::span<const JobRecord> records;  ///< Parallel to `jobs`; task kNoTask: not in the graph.
};

/// Preemption between threads. A job that lies within a job of another thread on the same processor
/// preempted it; a job that became ready during that job and began after it waited for it.
struct Displacement {
  std::vector<Duration> own;  ///< By job: its length without the jobs that preempted it.
  std::vector<int> level;     ///< By thread: relative priority; 0: it may have the ordinary policy.
};
[[nodiscard]] Displacement recorded_displacement(const tracing::System& system, const RecordedWindow& window);

[[nodiscard]] RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                                           const RecordedExecutor& executor, const ExecutorEntry& entry);

/// How often one task ran before another where the executor's order decided: among tasks of one
/// snapshot, if the executor's waits are events; among readers of one message, if it queues events.
struct Precedence {
  std::vector<std::vector<std::uint32_t>> before;  ///< By task, by task.
  double contradicting = 0;                        ///< Share of pairs that contradict the order of creation.
};
[[nodiscard]] Precedence recorded_precedence(const RecordedGraph& graph, const RecordedWindow& window,
                                             bool wait_sets);

/// Nodes and callbacks in the order that agrees with most pairs; equals in the order of creation.
[[nodiscard]] ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                                         const Precedence& precedence);

}  // namespace hotpath
