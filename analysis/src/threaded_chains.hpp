// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Chains on several threads that never idle while a callback is ready, in the manner of Bertogna and Cirinei
/// (docs/chain_bounds.md, "Threads of one executor"). Each chain is a timer and the subscriptions that follow
/// it, one after the other. Costs nothing but the callbacks' own work.
class ThreadedChains final : public PathBounds {
 public:
  /// `topology` must outlive this object; `threads` > 0. Throws AnalysisError if tasks belong to no chain or
  /// to several, or if an exclusive group has tasks of several chains.
  ThreadedChains(const GraphTopology& topology, unsigned threads);

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> response(TaskId subscription) const override;
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override {
    return root == to ? std::optional<std::int64_t>(0) : until_start(root, to);
  }
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override {
    return until_finish(root, to);
  }
  std::optional<std::int64_t> later_start_to_start(TaskId, TaskId, TaskId, TaskId, TaskId) const override {
    return std::nullopt;
  }
  bool overtakes(TaskId, TaskId) const override { return false; }
  std::optional<std::int64_t> precedence(TaskId, TaskId, TaskId) const override { return std::nullopt; }
  std::int64_t lateness() const override { return 0; }
  PathParts parts(TaskId, TaskId) const override { return {}; }

 private:
  struct Line {
    std::vector<TaskId> tasks;  ///< From the timer on.
    std::int64_t period, work;
    std::int64_t response;  ///< From the timestamp to the end of the last task.
  };

  void check_groups() const;
  [[nodiscard]] std::int64_t work_beside(const Line& line, std::int64_t window) const;
  [[nodiscard]] std::optional<std::int64_t> waiting(std::size_t line, std::int64_t before) const;
  bool find_responses();

  const GraphTopology& topology_;
  const std::int64_t threads_;
  std::vector<Line> lines_;
  std::vector<std::size_t> line_of_;       // by task
  std::vector<std::int64_t> work_before_;  // by task: of its line's earlier tasks
  bool bounded_ = false;
};

/// The bounds of several threads of one executor, each with a core. Throws AnalysisError for other systems.
void bound_threads(const BoundedSystem& system, GraphBounds& out);

}  // namespace hotpath
