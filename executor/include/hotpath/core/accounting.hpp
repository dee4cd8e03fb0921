// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <numeric>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// How often each outcome occurred for one task, and the expected total.
struct TaskAccount {
  std::array<std::uint64_t, enum_texts(Outcome{}).size()> count{};  ///< Indexed by Outcome.
  TaskId task = kNoTask;
  std::uint64_t expected = 0;  ///< Timers: timestamps in [epoch, end). Subscriptions: samples matched.

  std::uint64_t operator[](Outcome o) const { return count[static_cast<std::size_t>(o)]; }
  /// Counts a job and the timestamps that it skipped.
  void add(const JobRecord& r) {
    ++count[static_cast<std::size_t>(r.outcome)];
    count[static_cast<std::size_t>(Outcome::skipped)] += r.job.skipped;
  }
  /// Timers: ran + skipped + queued + running. Subscriptions: ran + overwritten + queued + running.
  [[nodiscard]] std::uint64_t accounted() const {
    return std::accumulate(count.begin(), count.end(), std::uint64_t{0}) - (*this)[Outcome::empty];
  }
  [[nodiscard]] bool balanced() const { return accounted() == expected; }
};

/// The number of a timer's timestamps from the epoch of a run to before `end`.
[[nodiscard]] std::uint64_t timestamps_in(const Task& timer, Time epoch, Time end);

/// The expected totals of a run by task: from period and phase (timers) and from the publishers' counts
/// (subscriptions), independently of the task's own records.
[[nodiscard]] std::vector<std::uint64_t> expected_jobs(const TaskSet& set, const Trace& trace);

/// The loss equations of a run, one account per task.
std::vector<TaskAccount> account(const TaskSet& set, const Trace& trace);

}  // namespace hotpath
