// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The smaller one of two bounds, of which either may be missing.
[[nodiscard]] inline std::optional<std::int64_t> smaller(std::optional<std::int64_t> a,
                                                         std::optional<std::int64_t> b) {
  return a && b ? std::min(*a, *b) : a ? a : b;
}

/// The platform's additions to the work of a graph, in nanoseconds, each >= 0.
struct GraphOverheads {
  std::int64_t job = 0;       ///< Before each job: dispatch, and a wait if every job may need one.
  std::int64_t wait = 0;      ///< Before each processing window of a wait set.
  std::int64_t release = 0;   ///< Executor time used by each timestamp of any timer.
  std::int64_t lateness = 0;  ///< Longest time from a timestamp until the executor sees its job.
  std::int64_t wake_up = 0;   ///< Time until an idle executor continues.
  std::int64_t delivery = 0;  ///< Longest time from a publication until its samples arrive.
};

/// The components of a bound from a timestamp to the end of a job, in nanoseconds.
struct PathParts {
  std::int64_t blocking = 0;  ///< By a job that had already started, or by the executor's wake-up.
  TaskId blocker = kNoTask;   ///< The longest blocking job; kNoTask if none blocks.
  /// Work before the end, by task, largest first: jobs that delay the path, and the path itself.
  std::vector<std::pair<TaskId, std::int64_t>> work;
};

/// Upper bounds on the time after a timestamp of a timer, `root`, whose job leads to a job of `to`,
/// in ns. std::nullopt: no bound.
class PathBounds {
 public:
  virtual ~PathBounds() = default;
  /// Until that job starts. A join may make that job wait, so that it does no work.
  [[nodiscard]] virtual std::optional<std::int64_t> until_start(TaskId root, TaskId to) const = 0;
  /// Until that job finishes its work.
  [[nodiscard]] virtual std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const = 0;
  /// From the start of a job of `root` to the start of the resulting job of `to`, which completes
  /// its join, if any.
  [[nodiscard]] virtual std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const = 0;
  /// The same from the later of two starts: of the job of `root`, and of the last job of `other`
  /// whose data waits at `input` for the path to complete the join of `input` by a job of `meets`.
  /// std::nullopt: not known.
  [[nodiscard]] virtual std::optional<std::int64_t> later_start_to_start(TaskId /*root*/, TaskId /*to*/,
                                                                         TaskId /*other*/, TaskId /*input*/,
                                                                         TaskId /*meets*/) const {
    return std::nullopt;
  }
  /// From the start of a job of `root` to the end of the resulting job of `to`.
  [[nodiscard]] virtual std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const = 0;
  /// Whether no job that is pending at the start of a job of `root` runs before the end of the
  /// resulting job of `to`.
  [[nodiscard]] virtual bool overtakes(TaskId /*root*/, TaskId /*to*/) const { return false; }
  /// A job of `first` whose timestamp is at least this long before the timestamp of a job of `root`
  /// leads to a job of `to` that starts before that job of `root` starts. std::nullopt: none known.
  [[nodiscard]] virtual std::optional<std::int64_t> precedence(TaskId /*first*/, TaskId /*to*/,
                                                               TaskId /*root*/) const {
    return std::nullopt;
  }
  /// Longest time from a timestamp until the executor sees its job.
  [[nodiscard]] virtual std::int64_t lateness() const = 0;
  /// The components of until_finish(), if it has a value.
  [[nodiscard]] virtual PathParts parts(TaskId root, TaskId to) const = 0;
  /// From the publication of a sample until the job of `subscription` that takes it finishes.
  [[nodiscard]] virtual std::optional<std::int64_t> response(TaskId subscription) const = 0;
};

/// The tighter of two bounds.
class TighterPaths : public PathBounds {
 public:
  /// `a` and `b` must outlive this object.
  TighterPaths(const PathBounds& a, const PathBounds& b) : a_(a), b_(b) {}
  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override {
    return smaller(a_.until_start(root, to), b_.until_start(root, to));
  }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override {
    return smaller(a_.until_finish(root, to), b_.until_finish(root, to));
  }
  PathParts parts(TaskId root, TaskId to) const override {
    const auto a = a_.until_finish(root, to), b = b_.until_finish(root, to);
    return a && (!b || *a <= *b) ? a_.parts(root, to) : b_.parts(root, to);
  }
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override {
    return smaller(a_.start_to_start(root, to), b_.start_to_start(root, to));
  }
  std::optional<std::int64_t> later_start_to_start(TaskId root, TaskId to, TaskId other, TaskId input,
                                                   TaskId meets) const override {
    return smaller(a_.later_start_to_start(root, to, other, input, meets),
                   b_.later_start_to_start(root, to, other, input, meets));
  }
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override {
    return smaller(a_.start_to_finish(root, to), b_.start_to_finish(root, to));
  }
  bool overtakes(TaskId root, TaskId to) const override {
    return a_.overtakes(root, to) || b_.overtakes(root, to);
  }
  std::optional<std::int64_t> precedence(TaskId first, TaskId to, TaskId root) const override {
    return smaller(a_.precedence(first, to, root), b_.precedence(first, to, root));
  }
  std::int64_t lateness() const override { return std::max(a_.lateness(), b_.lateness()); }
  std::optional<std::int64_t> response(TaskId subscription) const override {
    return smaller(a_.response(subscription), b_.response(subscription));
  }

 private:
  const PathBounds& a_;
  const PathBounds& b_;
};

}  // namespace hotpath
