// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Timers and the subscriptions that follow them, on several threads that never idle while a callback is
/// ready, in the manner of Bertogna and Cirinei, and where a task activates several others, of Melani et al.
/// (docs/chain_bounds.md, "Threads of one executor"). Costs nothing but the callbacks' own work.
class ThreadedChains final : public PathBounds {
 public:
  /// `topology` must outlive this object; `threads` > 0. Throws AnalysisError if a task waits for or reads
  /// several others, or if an exclusive group has tasks of which neither leads to the other.
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
  std::int64_t lateness() const override { return 0; }
  PathParts parts(TaskId, TaskId) const override { return {}; }

 private:
  /// A timer and all that follows it.
  struct Tree {
    TaskId root;
    std::int64_t period, work;
    std::int64_t width;     ///< How many of its tasks can run at once, on these threads.
    std::int64_t response;  ///< From the timestamp to the end of the last task.
  };
  struct Place {
    std::size_t tree;
    TaskId before = kNoTask;       ///< The task that activates it.
    std::int64_t work_before = 0;  ///< Of the tasks from the timer on.
    std::int64_t work_from = 0;    ///< Of the task and all that follows it.
    std::int64_t width = 0;        ///< How many of these can run at once.
  };

  void place(TaskId id, Place at);
  [[nodiscard]] bool leads_to(TaskId from, TaskId to) const;
  void check_groups() const;
  [[nodiscard]] std::int64_t work_beside(const Tree& tree, std::int64_t window) const;
  [[nodiscard]] std::optional<std::int64_t> waiting(TaskId task) const;
  bool find_responses();

  const GraphTopology& topology_;
  const std::int64_t threads_;
  std::vector<Tree> trees_;
  std::vector<Place> places_;  // by task
  bool bounded_ = false;
};

/// The bounds of several threads of one executor, each with a core. Throws AnalysisError for other systems.
void bound_threads(const BoundedSystem& system, GraphBounds& out);

}  // namespace hotpath
