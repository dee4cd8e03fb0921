// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "busy_level.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "job_counts.hpp"

namespace hotpath {

inline constexpr std::int64_t kNoRank = GraphOrder::kNone;
/// Windows with more jobs of their timer, or more steps to their end, count as endless: the
/// utilisation is close to 1.
inline constexpr std::uint64_t kMaxSteps = 10'000;
inline constexpr std::int64_t kEndless = std::int64_t{1} << 60;

/// A search in the windows of a level.
struct GraphBusyWindow::Query {
  std::shared_ptr<const BusyLevel> level;
  Blocker blocker;
  TaskId root = kNoTask, target = kNoTask;  ///< kNoTask: the window itself.
  bool works = true;                        ///< Whether the target's job completes its join, if it has one.
  bool later_root_jobs = true;           ///< Whether later jobs of `root` than the analysed one may precede.
  std::int64_t root_jobs = 0;            ///< Number of jobs of `root` up to the analysed one.
  bool closed = true;                    ///< Whether jobs released at the end of an interval count.
  bool from_arrival = false;             ///< Whether the time counts from the arrival of the root's job.
  std::optional<std::int64_t> deadline;  ///< Relative to the window's start; later deadlines do not precede.
  bool any_service = false;           ///< Whether services of the level, too, may run ahead of their ranks.
  std::int64_t services = 0;          ///< Result of work(): by services that run ahead of their ranks.
  std::vector<std::size_t> left_out;  ///< Nodes of the level, each with one job that does not count.
  /// Argument of work(): the level's rank, then the number of jobs of each of its timers.
  std::vector<std::int64_t> timers;
};

/// A range of timestamps of a root, relative to the window's start, and the longest job with a
/// later deadline that may have started before.
struct GraphBusyWindow::DeadlineStep {
  std::int64_t first, last;
  Blocker blocker;
  std::int64_t end;  ///< When all jobs with these or earlier deadlines are done.
};

/// Number of jobs of one timer, released from 0 on, with deadlines up to `deadline`.
inline std::int64_t urgent_jobs(const BusyLevel::Timers& timer, std::int64_t deadline) {
  const std::int64_t latest = deadline - timer.deadline;
  return latest < 0 ? 0 : latest / timer.period + 1;
}

/// Reusable state of work().
struct GraphBusyWindow::Counting {
  explicit Counting(std::size_t nodes) : change(nodes) {}
  KnownCounts known;
  JobChange change;
  const JobCounts* all = nullptr;  ///< The counts to which `change` applies.
};

}  // namespace hotpath
