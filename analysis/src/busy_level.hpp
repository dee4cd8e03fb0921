// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// A job outside of the level that may run when a window begins.
struct Blocker {
  TaskId task = kNoTask;     ///< kNoTask: it activates no task in the window.
  TaskId longest = kNoTask;  ///< The task with this `work`; kNoTask: not the work of a job.
  std::int64_t work = 0;
};

/// The jobs of a rank and of all smaller ranks, which make up that rank's windows. Laid out so that
/// GraphBusyWindow can count them repeatedly.
struct BusyLevel {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  static constexpr double kInfinite = std::numeric_limits<double>::infinity();

  /// A task of the level, or a join with some input in the level; a join has one job each time it
  /// fires.
  struct Node {
    TaskId id = kNoTask;       ///< kNoTask: a join.
    std::size_t join = kNone;  ///< For a join: its index in the graph.
    bool joined = false;       ///< Whether the task is an input of a join.
    bool complete = true;      ///< For a join: whether all its inputs are in the level.
    /// Work of each job, and idle time until its samples have arrived; for inputs of a join, without those of
    /// completing jobs.
    std::int64_t work = 0;
    std::vector<std::size_t> inputs{};  ///< For a join.
    /// Nodes that receive one job per job of this one; for an input of a join: the join.
    std::vector<std::size_t> feeds{};
  };
  /// Timers with the same number of jobs in any window, of one thread.
  struct Timers {
    std::int64_t period, deadline, jitter;
    std::size_t thread;
    std::vector<std::size_t> nodes;
  };

  /// A service, and the work of one of its jobs; kNoTask: there is none.
  struct Ahead {
    TaskId task = kNoTask;
    std::int64_t work = 0;
  };

  /// The references must outlive this object. `job_work`: of one job, by task.
  BusyLevel(const GraphTopology& topology, const GraphOrder& order, const GraphOverheads& overheads,
            const std::vector<std::int64_t>& job_work, std::int64_t rank);

  [[nodiscard]] bool inside(TaskId id) const { return node_of[id] != kNone; }

  std::int64_t rank;
  std::vector<Timers> timers;
  std::vector<Node> nodes;             ///< Every node follows the nodes that feed it.
  std::vector<std::size_t> node_of;    ///< By task; kNone: outside the level.
  std::vector<std::size_t> timers_of;  ///< By task: the index in `timers`; kNone: not in `timers`.
  std::vector<Blocker> blockers;       ///< None is dominated by another; empty if `utilisation` > 1.
  double utilisation = 0;              ///< Long-run work of the jobs per unit of time.
  /// The service that adds most work to the level if it runs ahead of its rank, with what it activates: of
  /// those outside the level, or of all.
  [[nodiscard]] const Ahead& ahead(bool of_all) const { return of_all ? any_ahead_ : outside_ahead_; }
  std::optional<std::int64_t> window;  ///< The longest window, for GraphBusyWindow; std::nullopt: unbounded.

 private:
  void find_ahead();
  Ahead outside_ahead_, any_ahead_;

  /// The work that one more job adds to the level: exact, or an upper limit.
  struct Effect {
    std::int64_t work = 0;
    bool exact = true;
  };

  void add_task(TaskId id);
  std::size_t join_at(std::size_t index);
  void add_up();
  [[nodiscard]] std::int64_t transit(TaskId id) const;
  [[nodiscard]] std::vector<Blocker> all_blockers() const;
  [[nodiscard]] std::vector<Effect> effects() const;
  void drop_dominated();

  const GraphTopology& topology_;
  const GraphOrder& order_;
  const GraphOverheads overheads_;
  const std::vector<std::int64_t>& job_work_;
};

}  // namespace hotpath
