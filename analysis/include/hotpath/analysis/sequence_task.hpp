// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// A sequence timer -> subscription -> subscription ..., treated as one task that can be preempted
/// between its segments (paper, Section VI). Times in nanoseconds.
struct SequenceTask {
  std::string name;
  TaskId id = kNoTask;                 ///< The timer.
  std::vector<std::int64_t> segments;  ///< WCET of the timer and of each subscription, each >= 0, sum > 0.
  std::int64_t period = 0;
  std::int64_t deadline = 0;    ///< Of the whole sequence.
  std::int64_t suspension = 0;  ///< Total DDS delay over all gaps between segments, >= 0.

  std::int64_t wcet() const;
  std::int64_t longest_segment() const;
};

/// In priority order, highest first.
using SequenceTasks = std::vector<SequenceTask>;

/// The sequences of `set` in the order of `policy`; a subscription belongs to the timer upstream.
/// Throws AnalysisError if the set does not consist of sequences: a task feeds two tasks, or a
/// subscription does not have exactly one task upstream.
SequenceTasks sequence_tasks(const TaskSet& set, Policy policy);

/// Throws AnalysisError for an empty set or times out of range; if `arbitrary_deadlines` is false,
/// also for D > T.
void check_sequences(const SequenceTasks& tasks, std::string_view method, bool arbitrary_deadlines);

}  // namespace hotpath
