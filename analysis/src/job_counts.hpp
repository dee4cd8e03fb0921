// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "busy_level.hpp"

namespace hotpath {

/// How many jobs of each node of a level run in a window, and what they work together.
struct JobCounts {
  std::vector<std::int64_t> jobs;
  std::int64_t work = 0;
};

/// What changes in the counts of a level when some nodes have more or fewer jobs. Only what is behind these
/// is looked at, in the level's order.
class JobChange {
 public:
  /// `nodes`: of the largest level.
  explicit JobChange(std::size_t nodes) : change_(nodes, 0), open_((nodes + 63) / 64, 0) {}

  void start();
  void add(std::size_t node, std::int64_t jobs);
  /// The work added to that of `from`. `target`: one job of it does not count, nor what it feeds; of a join's
  /// input the join completed by it loses one job in addition, if `target_completes`. kNone: no target.
  std::int64_t finish(const BusyLevel& level, const JobCounts& from, std::size_t target,
                      bool target_completes);

  /// By node, after finish().
  [[nodiscard]] std::int64_t of(std::size_t node) const { return change_[node]; }
  /// Makes `counts`, from which it was finished, those with the change.
  void apply(JobCounts& counts, std::int64_t work) const;

 private:
  [[nodiscard]] std::int64_t outputs(const BusyLevel::Node& join, const JobCounts& from) const;

  std::vector<std::int64_t> change_;
  std::vector<std::uint64_t> open_;  ///< By node, a bit: to be looked at.
  std::vector<std::size_t> changed_;
};

/// The counts of windows without a blocker or a target, found from those of similar windows.
class KnownCounts {
 public:
  /// `timers`: the rank of the level, then how many jobs each of `level.timers` has.
  const JobCounts& at(const BusyLevel& level, const std::vector<std::int64_t>& timers, JobChange& scratch);

 private:
  std::map<std::vector<std::int64_t>, JobCounts> known_;
};

}  // namespace hotpath
