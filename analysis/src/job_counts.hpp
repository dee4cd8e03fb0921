// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "busy_level.hpp"

namespace hotpath {

/// The number of jobs of each node of a level in a window, and their total work.
struct JobCounts {
  std::vector<std::int64_t> jobs;
  std::int64_t work = 0;
};

/// The change of a level's counts when some nodes have more or fewer jobs. Visits only nodes
/// downstream of these, in the level's order.
class JobChange {
 public:
  /// `nodes`: number of nodes of the largest level.
  explicit JobChange(std::size_t nodes) : change_(nodes, 0), open_((nodes + 63) / 64, 0) {}

  void start();
  void add(std::size_t node, std::int64_t jobs);
  /// Returns the work added to `from`. One job of `target`, and the jobs that it feeds, do not
  /// count; if `target` is an input of a join and `target_completes`, the join also loses one job.
  /// kNone: no target.
  std::int64_t finish(const BusyLevel& level, const JobCounts& from, std::size_t target,
                      bool target_completes);

  /// The change of one node; valid after finish().
  [[nodiscard]] std::int64_t of(std::size_t node) const { return change_[node]; }
  /// Applies the change to the counts that were passed to finish().
  void apply(JobCounts& counts, std::int64_t work) const;

 private:
  [[nodiscard]] std::int64_t outputs(const BusyLevel::Node& join, const JobCounts& from) const;

  std::vector<std::int64_t> change_;
  std::vector<std::uint64_t> open_;  ///< One bit per node: still to visit.
  std::vector<std::size_t> changed_;
};

/// A cache of the counts of windows without blocker or target; computes new ones from similar
/// windows.
class KnownCounts {
 public:
  /// `timers`: the level's rank, then the number of jobs of each of `level.timers`.
  const JobCounts& at(const BusyLevel& level, const std::vector<std::int64_t>& timers, JobChange& scratch);

 private:
  std::map<std::vector<std::int64_t>, JobCounts> known_;
};

}  // namespace hotpath
