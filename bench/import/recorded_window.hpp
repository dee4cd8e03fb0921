// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "import/recorded_executors.hpp"

namespace hotpath::imports {

/// Jobs of a recording and their records, in the order of starts.
struct RecordedWindow {
  std::span<const tracing::Job> jobs;  ///< Of all callbacks.
  std::span<const JobRecord> records;  ///< Parallel to `jobs`; task kNoTask: not in the graph.
};

/// A measured cost.
struct MeasuredCost {
  std::size_t n = 0;
  Duration median{}, p90{};
};

/// The costs of an executor, from the gaps between the jobs of its threads.
struct RecordedCosts {
  MeasuredCost dispatch;  ///< End of a job to the start of the next ready job of the same snapshot.
  MeasuredCost timer_dispatch, subscription_dispatch;  ///< The same by kind of that next job.
  MeasuredCost wait;      ///< The same as `dispatch` with a new wait between them, without the dispatch.
  MeasuredCost wake_up;   ///< Release of a job to its start on a thread that slept, without the dispatch.
  MeasuredCost delivery;  ///< The same for subscriptions only, from the publication.
  MeasuredCost timer_wake_up;  ///< The same for timers only, from the timestamp.

  [[nodiscard]] MeasuredCost dispatch_of(TaskKind kind) const;
};

/// How threads of the ordinary policy took turns on processors.
struct TimeSlices {
  std::size_t threads = 0;    ///< That share processors.
  std::size_t jobs = 0;       ///< Of these threads.
  std::size_t displaced = 0;  ///< How often a job lost its processor.
  std::size_t early = 0;      ///< Starts and ends for which the thread had to wait for a longer time slice.
  Time first_early{};
  std::size_t unexplained = 0;  ///< Threads that share processors in another way.
};

/// Preemption between threads. A job that lies within a job of another thread on the same processor
/// preempted it; a job that became ready during that job and began after it waited for it. A job that became
/// ready during that job and began later during it got a time slice.
struct Displacement {
  std::vector<Duration> own;  ///< By job: its length without the jobs that preempted it.
  std::vector<int> level;     ///< By thread: relative priority; 0: it may have the ordinary policy.
  std::vector<std::vector<std::int32_t>> processors;  ///< By thread: on which it may run.
  TimeSlices slices;
};
[[nodiscard]] Displacement recorded_displacement(const tracing::System& system, const RecordedWindow& window);

/// `elsewhere`: the dispatch of other executors, for one that never had two jobs ready.
[[nodiscard]] RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                                           const RecordedExecutor& executor, const ExecutorEntry& entry,
                                           const MeasuredCost& elsewhere = {});

/// The observations of the chains' sinks. Histories of jobs follow the recorded messages, and the
/// inferred rules within nodes. `graph.graph` has the chains.
[[nodiscard]] std::vector<ChainObservation> recorded_chains(const tracing::System& system,
                                                            const RecordedGraph& graph,
                                                            const RecordedWindow& window);

/// A task that publishes a topic well before its jobs end.
struct EarlyPublication {
  TaskId task = 0;
  std::uint32_t topic = kNone;  ///< Of the trace.
  Duration before_end{};        ///< Median time from a job's last message to its end.
  double share = 0;             ///< Median share of a job before its last message, 0 to 1.
};

/// Publications over a tenth of the job and over 0.1 ms before its end, the earliest first.
[[nodiscard]] std::vector<EarlyPublication> early_publications(const RecordedGraph& graph,
                                                               std::span<const tracing::Job> jobs);

/// Lets the graph's tasks publish at these instants.
void set_publication_instants(std::span<const EarlyPublication> early, RecordedGraph& graph);

}  // namespace hotpath::imports
