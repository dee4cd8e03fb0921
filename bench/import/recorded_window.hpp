// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// First release of each timer, and whether a separate thread calls it.
struct RecordedTimers {
  std::vector<Time> first;     ///< By task; Time{} for subscriptions.
  Time begin{};                ///< Start of the first job: executors spin from here on.
  std::vector<bool> released;  ///< By task: its jobs show that it is not called when they start.
};

/// `jobs` are in the order of starts. A timer's first release is its creation plus its period, and earlier
/// where jobs begin earlier, as the event follows the creation; an executor may state it. Throws UsageError
/// if the clock jumps: timers are due until `end` a thousand times as often as callbacks ran.
[[nodiscard]] RecordedTimers recorded_timers(const tracing::System& system, const RecordedGraph& graph,
                                             std::span<const tracing::Job> jobs, Time end);

/// A recording as rows of a run, in the trace's time.
struct RecordedRows {
  std::vector<JobRecord> jobs;  ///< Parallel to the recorded jobs; empty for those that are not in the graph.
  std::vector<JobRecord> others;  ///< Samples without a job, and timestamps that are due at the end.
};

/// A trace lacks the timestamps of timers. If a thread releases them, which `release_only` tells by task, the
/// n-th job has the n-th timestamp after those skipped at the beginning. Otherwise a timer is called when its
/// job starts, and skips timestamps by rcl's rule.
[[nodiscard]] RecordedRows recorded_rows(const RecordedSystem& recorded, const RecordedGraph& graph,
                                         const RecordedTimers& timers, const std::vector<bool>& release_only);

/// How long a job that ran had a processor, as far as that is known.
[[nodiscard]] inline Duration own_time(const JobRecord& r) {
  return r.cpu_time >= Duration{} ? r.cpu_time : r.duration();
}

/// Jobs of a recording and their records, in the order of starts.
struct RecordedWindow {
  std::span<const tracing::Job> jobs;  ///< Of all callbacks.
  std::span<const JobRecord> records;  ///< Parallel to `jobs`; task kNoTask: not in the graph.
};

/// Measured times.
struct MeasuredCost {
  std::size_t n = 0, outliers = 0;  ///< Outliers are above ten times the median.
  Duration least{}, median{}, p90{}, p99{}, greatest{};
};

/// The costs of an executor, from the gaps between the jobs of its threads.
struct RecordedCosts {
  MeasuredCost dispatch;  ///< End of a job to the start of the next ready job of the same snapshot.
  MeasuredCost timer_dispatch, subscription_dispatch;  ///< The same by kind of that next job.
  MeasuredCost wait;     ///< The same as `dispatch` with a new wait between them, without the dispatch.
  MeasuredCost wake_up;  ///< Release of a job to its start on a thread that slept, without the dispatch.
  /// Publications of recorded callbacks to the instants at which threads that slept could take the samples.
  std::vector<Duration> deliveries = {};

  [[nodiscard]] MeasuredCost dispatch_of(TaskKind kind) const;
};
inline constexpr std::array<std::pair<const char*, MeasuredCost RecordedCosts::*>, 5> kMeasuredCosts = {
    {{"dispatch", &RecordedCosts::dispatch},
     {"timer_dispatch", &RecordedCosts::timer_dispatch},
     {"subscription_dispatch", &RecordedCosts::subscription_dispatch},
     {"wait", &RecordedCosts::wait},
     {"wake_up", &RecordedCosts::wake_up}}};

/// How long samples of all executors took until a thread that slept could take them, with its wake-up.
[[nodiscard]] MeasuredCost measured_delivery(std::span<const RecordedCosts> costs);

/// How threads of the ordinary policy took turns on processors.
struct TimeSlices {
  std::size_t threads = 0;    ///< That share processors.
  std::size_t jobs = 0;       ///< Of these threads.
  std::size_t displaced = 0;  ///< How often a job lost its processor.
  std::size_t early = 0;      ///< Starts and ends for which the thread had to wait for a longer time slice.
  Time first_early{};
  std::size_t unexplained = 0;  ///< Threads that share processors in another way.
};

/// Preemption between threads. A job within a job of another thread on its processor preempted it, or got a
/// time slice if it had become ready during that job; a job that began after that job waited for it.
struct Displacement {
  std::vector<Duration> own;  ///< By job: its length without the jobs that preempted it.
  std::vector<int> level;     ///< By thread: relative priority; 0: it may have the ordinary policy.
  std::vector<std::vector<std::int32_t>> processors;  ///< By thread: on which it may run.
  TimeSlices slices;
};
[[nodiscard]] Displacement recorded_displacement(const tracing::System& system, const RecordedWindow& window);

/// `elsewhere`: the dispatch of other executors, for one that never had two jobs ready.
[[nodiscard]] RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                                           const RecordedExecutor& executor, const ExecutorTraits& traits,
                                           const MeasuredCost& elsewhere = {});

/// The observations of the chains' sinks, by the recorded messages, and the inferred rules within nodes.
[[nodiscard]] std::vector<ChainObservation> recorded_chains(const tracing::System& system,
                                                            const RecordedGraph& graph,
                                                            const RecordedWindow& window);

/// Sets the time on a processor of each job, where threads of the ordinary policy share processors in time
/// slices. The simulator's rule is replayed with the recorded instants, first without levels, then with them.
/// Where a waiting thread starts or ends a job, it gets the processor of the thread whose time slice ends
/// first. If that is rare, time slices explain the recording, and each thread may run on all of the shared
/// processors. Otherwise threads keep their times; only threads without levels on one processor always take
/// turns.
void follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                        Displacement& displacement);

/// What was found, with instants from `epoch` on.
[[nodiscard]] std::string sentence(const TimeSlices& slices, Time epoch);
/// What is wrong with threads that share processors in another way.
[[nodiscard]] std::string unexplained_sentence(const TimeSlices& slices);

}  // namespace hotpath::imports
