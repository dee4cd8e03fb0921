// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath {

/// First release of each task's timer, and what the jobs say about how it is called.
struct RecordedTimers {
  std::vector<Time> first;     ///< By task; Time{} for subscriptions.
  Time begin{};                ///< Of the first job: executors spin from here on.
  std::vector<bool> released;  ///< By task: its jobs contradict that it is called when they start.
};

/// `jobs` are by start. A timer's first release is its creation plus its period; where jobs begin somewhat
/// before what follows from the event of the creation, which comes a little after it, it is as much earlier.
/// Throws UsageError for timers that are due until `end` a thousand times as often as anything ran: then the
/// clock of the trace jumps.
[[nodiscard]] RecordedTimers recorded_timers(const RecordedSystem& system, const RecordedGraph& graph,
                                             std::span<const RecordedJob> jobs, Time end);

/// Turns what was recorded into the rows of a run. Timestamps of timers are not in a trace: where a
/// releaser's thread calls timers, the n-th job has the n-th after those skipped when it began; else a timer
/// is called when its job starts, and rcl's rule says which timestamps it skips.
class RecordedTrace {
 public:
  /// `release_only`: by task. System and graph must outlive it.
  RecordedTrace(const RecordedSystem& system, const RecordedGraph& graph, const RecordedTimers& timers,
                std::vector<bool> release_only);

  /// Of a job of the graph; jobs come by start. Instants are as in the trace.
  [[nodiscard]] JobRecord job(const RecordedJob& job);
  [[nodiscard]] JobRecord lost(std::uint32_t subscription, const RecordedSample& sample, bool queued) const;
  /// Timers that are due at the end and have not started.
  [[nodiscard]] std::vector<JobRecord> due(Time end) const;

 private:
  /// As many jobs back as a sample may stay unread.
  static constexpr std::size_t kRemembered = 1024;
  struct TimerState {
    Time next{};
    std::uint64_t sequence = 0;
  };
  Job timer_job(TaskId task, Time start);
  JobRef parent_of(const RecordedRef& ref) const;

  const RecordedSystem& system_;
  const RecordedGraph& graph_;
  const std::vector<bool> release_only_;
  const Time begin_;
  std::vector<TimerState> timers_;                     // by task
  std::vector<std::vector<std::uint64_t>> sequences_;  // by task: of the latest jobs, by number
};

}  // namespace hotpath
