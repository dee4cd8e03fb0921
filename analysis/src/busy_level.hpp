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
  /// A task of the level. Its publishers and sources are those of the level's lists from the end of the
  /// member before it.
  struct Member {
    TaskId id = kNoTask;
    bool timer = false;
    std::size_t period = 0;  ///< Of a timer: the index of its period.
    std::int64_t work = 0;   ///< Of each job; of a join's inputs without that of the jobs that complete it.
    std::size_t publishers_end = 0, sources_end = 0;
  };
  /// A join that has some input in the level.
  struct Join {
    std::size_t index = 0;            ///< In the graph.
    std::vector<std::size_t> inputs;  ///< Members.
    bool complete = true;             ///< All its inputs are members.
    std::int64_t work = 0;            ///< Of a job that completes it.
  };

  BusyLevel(const GraphTopology& topology, const GraphOrder& order, const GraphOverheads& overheads,
            std::int64_t rank);

  [[nodiscard]] bool inside(TaskId id) const { return member_of[id] != kNone; }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::int64_t rank;
  std::vector<std::int64_t> periods;    ///< Of its timers, each once.
  std::vector<Member> members;          ///< Each behind those that activate it.
  std::vector<std::size_t> publishers;  ///< Members that are in no join.
  std::vector<std::size_t> sources;     ///< Joins that publish to members.
  std::vector<Join> joins;
  std::vector<std::size_t> member_of;  ///< By task; kNone: it is outside.
  std::vector<Blocker> blockers;       ///< Each delays something more than all others; empty above 1.
  double utilisation = 0;              ///< Long-run work of its jobs per time.
  std::optional<std::int64_t> window;  ///< Its longest window, for GraphBusyWindow; none: it has no end.

 private:
  /// What one more job adds to the work of the level: all of it, or at most.
  struct Effect {
    std::int64_t work = 0;
    bool exact = true;
  };

  void add_member(TaskId id);
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
