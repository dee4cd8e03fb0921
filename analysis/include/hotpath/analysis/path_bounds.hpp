// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// What the platform adds to the work of a graph, nanoseconds, each >= 0.
struct GraphOverheads {
  std::int64_t job = 0;       ///< In front of each job: dispatch, and a wait where every job may need one.
  std::int64_t wait = 0;      ///< In front of each processing window of a wait set.
  std::int64_t release = 0;   ///< Taken from the executor for each timestamp of any timer.
  std::int64_t lateness = 0;  ///< Longest time from a timestamp until the executor sees the job.
  std::int64_t wake_up = 0;   ///< Until an idle executor goes on.
  std::int64_t delivery = 0;  ///< From a publication until the executor sees the sample.
};

/// What a bound from a timestamp to the end of a job consists of, nanoseconds.
struct PathParts {
  std::int64_t blocking = 0;  ///< By a job that had started, or until the executor woke up.
  TaskId blocker = kNoTask;   ///< The longest such job; none: nobody blocks.
  /// What runs before the end, by task, the largest first: whatever it is, it delays or is the path itself.
  std::vector<std::pair<TaskId, std::int64_t>> work;
};

/// Upper bounds on what happens after a timestamp of a timer, `root`, whose job leads to a job of `to`. None:
/// there is no bound.
class PathBounds {
 public:
  virtual ~PathBounds() = default;
  /// Until that job starts. It may be one that a join makes wait, and thus without work.
  [[nodiscard]] virtual std::optional<std::int64_t> until_start(TaskId root, TaskId to) const = 0;
  /// Until it finishes its work.
  [[nodiscard]] virtual std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const = 0;
  /// What until_finish() consists of, where it is not none.
  [[nodiscard]] virtual PathParts parts(TaskId root, TaskId to) const = 0;
  /// From the publication of a sample until the job of `subscription` that takes it finishes.
  [[nodiscard]] virtual std::optional<std::int64_t> response(TaskId subscription) const = 0;
};

/// The tighter of two.
class TighterPaths : public PathBounds {
 public:
  /// They must outlive it.
  TighterPaths(const PathBounds& a, const PathBounds& b) : a_(a), b_(b) {}
  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override {
    return tighter(a_.until_start(root, to), b_.until_start(root, to));
  }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override {
    return tighter(a_.until_finish(root, to), b_.until_finish(root, to));
  }
  PathParts parts(TaskId root, TaskId to) const override {
    const auto a = a_.until_finish(root, to), b = b_.until_finish(root, to);
    return a && (!b || *a <= *b) ? a_.parts(root, to) : b_.parts(root, to);
  }
  std::optional<std::int64_t> response(TaskId subscription) const override {
    return tighter(a_.response(subscription), b_.response(subscription));
  }

 private:
  static std::optional<std::int64_t> tighter(std::optional<std::int64_t> a, std::optional<std::int64_t> b) {
    return a && b ? std::min(*a, *b) : a ? a : b;
  }

  const PathBounds& a_;
  const PathBounds& b_;
};

}  // namespace hotpath
