// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

struct Blocker;
struct BusyLevel;

/// The order in which one executor thread runs pending jobs: the smaller rank first.
struct GraphOrder {
  std::vector<std::int64_t> rank;  ///< By task.
  /// A timer's job never precedes a pending job of its own or a smaller rank that was released
  /// before it. Otherwise jobs of one rank run in any order. By deadline: among jobs of one
  /// deadline, subscriptions precede timers, and timers follow each other by id.
  bool timers_behind_equals = false;
  /// At the same instant, releases happen before the executor decides.
  bool releases_first = false;
  /// Among jobs of one rank, the earliest absolute deadline goes first: the deadline of the timer's
  /// job, which subscriptions inherit. All ranks are equal then.
  bool by_deadline = false;
};

/// One rank for all tasks: covers every order that never idles while a job is pending.
GraphOrder any_order(const TaskSet& set);

/// Busy windows of one thread that runs jobs to completion in a fixed order of ranks
/// (docs/analysis.md, "Busy windows of a graph"). The jobs of a timer and of the subscriptions
/// downstream count together, jobs of joins once.
class GraphBusyWindow : public PathBounds {
 public:
  /// The topology must outlive this object. Does not cover delivery delays, with which samples in
  /// transit would count.
  GraphBusyWindow(const GraphTopology& topology, GraphOrder order, const GraphOverheads& overheads);
  ~GraphBusyWindow() override;

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> later_start_to_start(TaskId root, TaskId to, TaskId other, TaskId input,
                                                   TaskId meets) const override;
  bool overtakes(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> precedence(TaskId first, TaskId to, TaskId root) const override;
  std::int64_t lateness() const override { return overheads_.lateness; }
  std::optional<std::int64_t> response(TaskId subscription) const override;
  PathParts parts(TaskId root, TaskId to) const override;

 private:
  struct Query;
  struct Counting;
  struct DeadlineStep;

  std::shared_ptr<const BusyLevel> level(std::int64_t rank) const;
  std::int64_t largest_rank(TaskId root, TaskId to, bool with_root = true) const;
  std::int64_t job_work(TaskId id) const;
  std::int64_t releases_work(std::int64_t t) const;
  std::int64_t arrivals(std::int64_t period, std::int64_t t, bool closed) const;
  void count_timers(Query& query, std::int64_t t) const;
  std::int64_t work(Query& query, std::int64_t t) const;
  std::int64_t work_of_jobs(const Query& query) const;
  std::optional<std::int64_t> end_of_work(Query& query, std::int64_t from) const;
  std::optional<std::int64_t> bound(TaskId root, TaskId to, bool works) const;
  std::optional<std::int64_t> find_bound(TaskId root, TaskId to, bool works, PathParts* parts) const;
  std::optional<std::int64_t> bound_by_deadline(TaskId root, TaskId to, bool works, PathParts* parts) const;
  Blocker blocker_behind(std::int64_t deadline) const;
  const std::optional<std::vector<DeadlineStep>>& deadline_steps(TaskId root) const;
  std::vector<std::int64_t> deadline_starts(TaskId root, std::int64_t until) const;
  Query query(TaskId root, const DeadlineStep& step) const;
  std::vector<TaskId> only_path(TaskId root, TaskId to) const;
  std::vector<TaskId> left_behind(TaskId root, TaskId to) const;
  std::optional<Query> query_from_start(TaskId root, TaskId to) const;
  std::int64_t own_work(const Query& query) const;
  bool window_ends_by(const Query& query, std::int64_t next) const;
  std::int64_t end_after(std::int64_t start, std::int64_t own_work) const;
  std::int64_t response_to(const Query& query, std::int64_t start, std::int64_t released) const;
  PathParts parts_of(const Query& query) const;
  std::optional<std::int64_t> bound(Query& query, std::vector<std::int64_t>& starts, PathParts* parts) const;
  std::optional<std::int64_t> start_of(Query& query, std::int64_t from,
                                       std::vector<std::int64_t>& starts) const;

  const GraphTopology& topology_;
  const GraphOrder order_;
  const GraphOverheads overheads_;
  /// By period: total work of one release of each of its timers.
  std::map<std::int64_t, std::int64_t> release_work_;
  const std::unique_ptr<Counting> counting_;
  // Filled on demand.
  mutable std::map<std::int64_t, std::shared_ptr<const BusyLevel>> levels_;
  mutable std::size_t known_nodes_ = 0;  ///< Number of nodes in `levels_`; too many clear it.
  mutable std::map<TaskId, std::optional<std::vector<DeadlineStep>>> steps_;
  mutable std::map<std::tuple<TaskId, TaskId, bool>, std::optional<std::int64_t>> known_;
  /// By rank, target, whether the target works, and blocker: the start of the first job, where it
  /// is the same for every root.
  mutable std::map<std::tuple<std::int64_t, TaskId, bool, TaskId>, std::optional<std::int64_t>> first_starts_;
  /// By rank, root, blocker and job of the root: whether the window ends before the root's next
  /// job.
  mutable std::map<std::tuple<std::int64_t, TaskId, TaskId, std::int64_t>, bool> ends_;
};

}  // namespace hotpath
