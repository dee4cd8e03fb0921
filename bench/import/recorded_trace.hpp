// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/core/trace.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// First release of each timer, and whether a separate thread calls it.
struct RecordedTimers {
  std::vector<Time> first;     ///< By task; Time{} for subscriptions.
  Time begin{};                ///< Start of the first job: executors spin from here on.
  std::vector<bool> released;  ///< By task: its jobs show that it is not called when they start.
};

/// `jobs` are in the order of starts. A timer's first release is its creation plus its period. The
/// event of the creation comes slightly after it; where jobs begin earlier than this event allows,
/// the release moves earlier by as much. An executor that states the nominal instants of its jobs
/// gives it exactly. Throws UsageError if the clock of the trace jumps: then
/// timers are due until `end` a thousand times as often as callbacks ran.
[[nodiscard]] RecordedTimers recorded_timers(const tracing::System& system, const RecordedGraph& graph,
                                             std::span<const tracing::Job> jobs, Time end);

/// Converts a recording into the rows of a run. A trace lacks the timestamps of timers. If a
/// releaser's thread calls timers, the n-th job has the n-th timestamp after those skipped at the
/// beginning. Otherwise a timer is called when its job starts, and rcl's rule decides which
/// timestamps it skips.
class RecordedTrace {
 public:
  /// `release_only`: by task. System and graph must outlive it.
  RecordedTrace(const tracing::System& system, const RecordedGraph& graph, const RecordedTimers& timers,
                std::vector<bool> release_only);

  /// The row of a job of the graph, in the trace's time; call it in the order of starts.
  [[nodiscard]] JobRecord job(const tracing::Job& job);
  /// The rows of all jobs; an empty one for those that are not in the graph.
  [[nodiscard]] std::vector<JobRecord> jobs(std::span<const tracing::Job> jobs);
  [[nodiscard]] JobRecord lost(const tracing::LostSample& lost) const;
  /// Timestamps that are due at the end without a started job.
  [[nodiscard]] std::vector<JobRecord> due(Time end) const;

 private:
  /// A sample may stay unread for this many jobs of its publisher.
  static constexpr std::size_t kRemembered = 1024;
  Job timer_job(TaskId task, Time start);
  Job subscription_job(TaskId task, const tracing::Sample& sample) const;

  const tracing::System& system_;
  const RecordedGraph& graph_;
  const std::vector<bool> release_only_;
  const RecordedTimers recorded_timers_;
  std::vector<Timer> timers_;                          // by task
  std::vector<std::vector<std::uint64_t>> sequences_;  // by task, by number: of the latest jobs
};

}  // namespace hotpath::imports
