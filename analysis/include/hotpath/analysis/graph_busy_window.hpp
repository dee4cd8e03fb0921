// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// The order in which one executor thread runs what is pending: jobs of the smaller rank first.
struct GraphOrder {
  std::vector<std::int64_t> rank;  ///< By task.
  /// A timer's job never precedes anything pending of its rank or a smaller one that was released before it.
  /// Otherwise jobs of one rank run in any order.
  bool timers_behind_equals = false;
  /// At one instant releases happen before the executor decides.
  bool releases_first = false;
};

/// One rank for all: whatever order the executor follows, it never idles while a job is pending.
GraphOrder any_order(const TaskSet& set);

/// Busy windows of one thread that runs jobs to their ends in a fixed order of ranks (docs/analysis.md,
/// "Busy windows of a graph"): the jobs of a timer and of the subscriptions downstream count together, those
/// of joins once.
class GraphBusyWindow : public PathBounds {
 public:
  /// The topology must outlive it. Delivery must take no time: `overheads.delivery` == 0.
  GraphBusyWindow(const GraphTopology& topology, GraphOrder order, const GraphOverheads& overheads);

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> response(TaskId subscription) const override;

 private:
  struct Query;
  struct Blocker {
    TaskId task = kNoTask;
    std::int64_t work = 0;
  };

  std::optional<std::int64_t> bound(TaskId root, TaskId to, bool works) const;
  std::optional<std::int64_t> bound(Query& query) const;
  std::int64_t largest_rank(TaskId root, TaskId to) const;
  std::vector<Blocker> blockers(std::int64_t rank) const;
  double utilisation(std::int64_t rank) const;
  bool inside(TaskId id, std::int64_t rank) const { return order_.rank[id] <= rank; }
  std::int64_t join_output(std::size_t join, const std::vector<std::int64_t>& jobs, std::int64_t rank) const;
  std::int64_t job_work(TaskId id) const;
  std::int64_t releases_work(std::int64_t t) const;
  std::int64_t arrivals(TaskId timer, std::int64_t t, bool closed) const;
  std::int64_t work(Query& query, std::int64_t t) const;
  std::optional<std::int64_t> end_of_work(Query& query, std::int64_t from) const;

  const GraphTopology& topology_;
  const GraphOrder order_;
  const GraphOverheads overheads_;
};

}  // namespace hotpath
