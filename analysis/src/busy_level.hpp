// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// What may run when a window begins: a job outside of its level.
struct Blocker {
  TaskId task = kNoTask;     ///< None: none that activates something in the window.
  TaskId longest = kNoTask;  ///< Whose `work` it is; none: no job's.
  std::int64_t work = 0;
};

/// The jobs of a rank and of those before it: what the windows of that rank are made of, laid out for
/// GraphBusyWindow to count them again and again.
struct BusyLevel {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// A task of the level, or a join that has some input in it: it has a job for each time that it fires.
  struct Node {
    TaskId id = kNoTask;       ///< None: a join.
    std::size_t join = kNone;  ///< Of a join: its index in the graph.
    bool joined = false;       ///< A task that is an input of a join.
    bool complete = true;      ///< Of a join: all its inputs are in the level.
    std::int64_t work = 0;     ///< Of each job; of a join's inputs without that of the jobs that complete it.
    std::vector<std::size_t> inputs{};  ///< Of a join.
    std::vector<std::size_t>
        feeds{};  ///< A job of it brings one to each of these; of a join's input: the join.
  };
  /// Timers with equally many jobs in any window.
  struct Timers {
    std::int64_t period, deadline;
    std::vector<std::size_t> nodes;
  };

  BusyLevel(const GraphTopology& topology, const GraphOrder& order, const GraphOverheads& overheads,
            std::int64_t rank);

  [[nodiscard]] bool inside(TaskId id) const { return node_of[id] != kNone; }

  std::int64_t rank;
  std::vector<Timers> timers;
  std::vector<Node> nodes;             ///< Each behind those that feed it.
  std::vector<std::size_t> node_of;    ///< By task; kNone: it is outside.
  std::vector<std::size_t> timers_of;  ///< By task: the index in `timers`; kNone: it is none of them.
  std::vector<Blocker> blockers;       ///< Each delays something more than all others; empty above 1.
  double utilisation = 0;              ///< Long-run work of its jobs per time.
  std::optional<std::int64_t> window;  ///< Its longest window, for GraphBusyWindow; none: it has no end.

 private:
  /// What one more job adds to the work of the level: all of it, or at most.
  struct Effect {
    std::int64_t work = 0;
    bool exact = true;
  };

  void add_task(TaskId id);
  std::size_t join_at(std::size_t index);
  void add_up();
  [[nodiscard]] std::int64_t job_work(TaskId id) const;
  [[nodiscard]] std::vector<Blocker> all_blockers() const;
  [[nodiscard]] std::vector<Effect> effects() const;
  void drop_dominated();

  const GraphTopology& topology_;
  const GraphOverheads overheads_;
};

}  // namespace hotpath
