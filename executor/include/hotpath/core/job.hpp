// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath {

/// Identifies one job of one task.
struct JobRef {
  TaskId task = kNoTask;
  std::uint64_t sequence = 0;
  friend bool operator==(const JobRef&, const JobRef&) = default;
};

/// The facts about an arriving sample that a scheduler needs.
struct SampleInfo {
  Time published{};        ///< Instant of the publication.
  Time deadline = kNever;  ///< Absolute deadline of the job that published it.
  JobRef parent{};         ///< The job that published it.
};

/// One activation of a task. It holds no sample: the driver owns samples.
struct Job {
  TaskId task = kNoTask;
  /// Timers: index of the timestamp (0 is the first). Subscriptions: index of the sample at this reader.
  std::uint64_t sequence = 0;
  Time timestamp{};           ///< Nominal release instant (timer) or publication instant (subscription).
  Time release{};             ///< When the job entered the ready queue (events) or the wait set's snapshot.
  Time deadline = kNever;     ///< Absolute; a subscription's job inherits the deadline of the publishing job.
  std::uint32_t skipped = 0;  ///< Timers: timestamps after this one for which no job is ever released.
  bool empty = false;         ///< Subscriptions: no sample is left for this event.
  JobRef parent{};            ///< Subscriptions: the publishing job. Last, so that no padding follows.

  [[nodiscard]] JobRef ref() const { return {task, sequence}; }
};

/// Whether it is a timer's job; a subscription's has the job that published.
[[nodiscard]] inline bool is_of_timer(const Job& job) { return job.parent.task == kNoTask; }

/// The fate of a job or timestamp; the column `outcome` of jobs.csv.
enum class Outcome : std::uint8_t {
  ran,
  skipped,      ///< Timestamp of a timer for which no job is ever released (rcl's rule for a late timer).
  overwritten,  ///< Sample replaced in the reader's history before it was taken.
  queued,       ///< Released, or unread, but not started when the run ended or the task was removed.
  running,      ///< Started but not finished when the run ended.
  empty,        ///< Event whose sample had been overwritten or taken: nothing ran.
};

constexpr auto enum_texts(Outcome) {
  return texts_in_order<Outcome>({"ran", "skipped", "overwritten", "queued", "running", "empty"});
}

}  // namespace hotpath
