// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath {

/// Threads that share callbacks, and what kind of executor they may be of.
struct RecordedExecutor {
  std::string name;
  std::uint32_t process = 0;            ///< Its id.
  std::vector<std::uint32_t> threads;   ///< Those that ran callbacks, by their position in the system.
  std::vector<std::string> candidates;  ///< Labels as on the command line, the likeliest first; >= 1.
  std::string why;                      ///< What in the trace says so.
};

struct RecordedExecutors {
  std::vector<RecordedExecutor> executors;
  std::vector<std::uint32_t> of_callback;  ///< By callback; kNone: no thread ran it.
};

/// Two callbacks that ran on one thread share an executor. `given`: the executor if the user knows it.
[[nodiscard]] RecordedExecutors recorded_executors(const RecordedSystem& system, const std::string& given);

/// The processors on which a thread's jobs ended, but for one job in a hundred.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const RecordedThread& thread);

/// One cost as it was measured.
struct MeasuredCost {
  std::size_t n = 0;
  Duration median{}, p90{};
};

/// What an executor costs, from the gaps between the jobs of its threads.
struct RecordedCosts {
  MeasuredCost dispatch;  ///< End of a job to the start of the next one, ready, of the same snapshot.
  MeasuredCost wait;      ///< The same where it took a new wait, beyond the dispatch.
  MeasuredCost wake_up;   ///< Release of a job to its start on a thread that slept, beyond the dispatch.
  MeasuredCost delivery;  ///< The same of subscriptions alone, from the publication on.
};

/// `records` are those of all `jobs` of the graph, parallel; both by start.
struct RecordedWindow {
  std::span<const RecordedJob> jobs;   ///< Of all callbacks.
  std::span<const JobRecord> records;  ///< Parallel to jobs; task kNoTask where it is none of the graph's.
};

/// What jobs on one processor tell of its threads. A job that lies within another one's, on another thread,
/// has displaced it; one that was ready and began after it has waited for it.
struct Displacement {
  std::vector<Duration> own;  ///< By job: its length without that of the jobs that displaced it.
  std::vector<int> level;     ///< By thread: its priority in turn; 0: it need not have any.
};
[[nodiscard]] Displacement recorded_displacement(const RecordedSystem& system, const RecordedWindow& window);

[[nodiscard]] RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                                           const RecordedExecutor& executor, const ExecutorEntry& entry);

/// How often one task came before another where an executor's order decided: of one snapshot, where the
/// executor's waits are events; of the same message's readers, where it queues events.
struct Precedence {
  std::vector<std::vector<std::uint32_t>> before;  ///< By task, by task.
  double contradicting = 0;                        ///< Share of the pairs that is not in order of creation.
};
[[nodiscard]] Precedence recorded_precedence(const RecordedGraph& graph, const RecordedWindow& window,
                                             bool wait_sets);

/// Nodes and callbacks in the order that agrees with most of these pairs; of equals the first created first.
[[nodiscard]] ServiceOrder service_order(const RecordedSystem& system, const RecordedGraph& graph,
                                         const Precedence& precedence);

}  // namespace hotpath
