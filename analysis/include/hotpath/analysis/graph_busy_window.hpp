// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
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

/// The order in which one processor runs pending jobs: the smaller rank first.
struct GraphOrder {
  /// Smaller than the rank of any task.
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
  /// Rank of a timer that stands for samples from elsewhere: its jobs take no time.
  static constexpr std::int64_t kArrival = -1;

  std::vector<std::int64_t> rank;  ///< By task.
  /// Ties `lifo`: among subscriptions of one rank, the most recently activated goes first. By deadline: also,
  /// among jobs of one deadline, subscriptions precede timers, and timers follow each other by id. Otherwise
  /// jobs of one rank run in any order, those of one task in the order of their activation.
  bool newest_first = false;
  /// At the same instant, releases happen before the executor decides.
  bool releases_first = false;
  /// Among jobs of one rank, the earliest absolute deadline goes first: the deadline of the timer's
  /// job, which subscriptions inherit. All ranks are equal then.
  bool by_deadline = false;
  /// The largest rank of each executor thread, from the most urgent thread on. A thread preempts those
  /// behind it, and runs its own jobs to their ends. Tasks of larger ranks have no bound: their threads share
  /// what is left. Empty: there is one thread.
  std::vector<std::int64_t> threads = {};
  /// By task: how much later than its timestamp a timer's job may come, besides GraphOverheads::lateness;
  /// kUnbounded: any time. Empty: none comes later.
  std::vector<std::int64_t> jitter = {};
  static constexpr std::int64_t kUnbounded = -1;
  /// > 0: a job of a service (Task::service) that has waited for so long may go ahead of all ranks, and
  /// at most one does in any interval of this length.
  std::int64_t service_wait = 0;

  [[nodiscard]] std::size_t thread_of(std::int64_t its_rank) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(threads, its_rank) - threads.begin());
  }
  /// The largest rank of the threads that preempt the thread of this rank; kNone: none does.
  [[nodiscard]] std::int64_t above(std::int64_t its_rank) const {
    const std::size_t thread = thread_of(its_rank);
    return thread == 0 ? kNone : threads[thread - 1];
  }
  [[nodiscard]] std::int64_t jitter_of(TaskId timer) const { return jitter.empty() ? 0 : jitter[timer]; }
};

/// One rank for all tasks: covers every order that never idles while a job is pending.
GraphOrder any_order(const TaskSet& set);

/// Busy windows of one processor whose threads run jobs to completion in a fixed order of ranks
/// (docs/response_bounds.md, "Busy windows of a graph"). The jobs of a timer and of the subscriptions
/// downstream count together, jobs of joins once.
class GraphBusyWindow : public PathBounds {
 public:
  /// The topology must outlive this object. Covers GraphOverheads::delivery only if all tasks have one
  /// rank: under others, the thread may run jobs of larger ranks while samples are on their way.
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
  /// Like until_finish(), or until_start() unless it works, but from the instant at which the job of `root`
  /// comes, which may be later than its timestamp.
  [[nodiscard]] std::optional<std::int64_t> since_arrival(TaskId root, TaskId to, bool works) const;
  /// The longest time for which jobs of the task's rank or of a smaller rank may be pending.
  [[nodiscard]] std::optional<std::int64_t> longest_window(TaskId id) const;

 private:
  struct Query;
  struct Counting;
  struct DeadlineStep;

  std::shared_ptr<const BusyLevel> level(std::int64_t rank) const;
  std::int64_t largest_rank(TaskId root, TaskId to, bool with_root = true) const;
  std::int64_t releases_work(std::int64_t t) const;
  std::int64_t services_work(const Query& query, std::int64_t t) const;
  std::int64_t work_besides(Query& query, std::int64_t t) const;
  bool runs_ahead(TaskId id) const;
  std::int64_t arrivals(std::int64_t period, std::int64_t t, bool closed, std::int64_t jitter = 0) const;
  void count_timers(Query& query, std::int64_t t) const;
  std::int64_t work(Query& query, std::int64_t t) const;
  std::int64_t work_of_jobs(const Query& query) const;
  std::optional<std::int64_t> end_of_work(Query& query, std::int64_t from) const;
  std::optional<std::int64_t> bound(TaskId root, TaskId to, bool works, bool from_arrival = false) const;
  std::optional<std::int64_t> find_bound(Query& query, TaskId root, TaskId to, PathParts* parts) const;
  bool later_jobs_precede(TaskId root, TaskId to, const BusyLevel& level) const;
  std::optional<std::int64_t> response_behind(TaskId publisher, TaskId subscription) const;
  std::optional<std::int64_t> bound_by_deadline(TaskId root, TaskId to, bool works, PathParts* parts) const;
  Blocker blocker_behind(std::int64_t deadline) const;
  const std::optional<std::vector<DeadlineStep>>& deadline_steps(TaskId root) const;
  std::vector<std::int64_t> deadline_starts(TaskId root, std::int64_t until) const;
  Query query(TaskId root, const DeadlineStep& step) const;
  std::vector<TaskId> only_path(TaskId root, TaskId to) const;
  std::vector<TaskId> left_behind(TaskId root, TaskId to) const;
  void limit_to_deadline(Query& query, TaskId root) const;
  bool precedes_pending(TaskId root, TaskId to) const;
  std::optional<Query> query_from_start(TaskId root, TaskId to) const;
  std::int64_t own_work(const Query& query) const;
  bool window_ends_by(const Query& query, std::int64_t next) const;
  std::int64_t preempting_work(const Query& query, std::int64_t rank) const;
  std::optional<std::int64_t> end_after(Query& query, std::int64_t start, std::int64_t own_work) const;
  std::optional<std::int64_t> response_to(Query& query, std::int64_t start, std::int64_t released) const;
  PathParts parts_of(const Query& query) const;
  std::optional<std::int64_t> bound(Query& query, std::vector<std::int64_t>& starts, PathParts* parts) const;
  std::optional<std::int64_t> start_of(Query& query, std::int64_t from,
                                       std::vector<std::int64_t>& starts) const;

  const GraphTopology& topology_;
  const GraphOrder order_;
  const GraphOverheads overheads_;
  std::vector<std::int64_t> job_work_;  ///< Of one job, by task.
  /// By period: total work of one release of each of its timers.
  std::map<std::int64_t, std::int64_t> release_work_;
  const std::unique_ptr<Counting> counting_;
  // Filled on demand.
  mutable std::map<std::int64_t, std::shared_ptr<const BusyLevel>> levels_;
  mutable std::size_t known_nodes_ = 0;  ///< Number of nodes in `levels_`; too many clear it.
  mutable std::map<TaskId, std::optional<std::vector<DeadlineStep>>> steps_;
  mutable std::map<std::tuple<TaskId, TaskId, bool, bool>, std::optional<std::int64_t>> known_;
  /// By rank, target, whether the target works, and blocker: the start of the first job, where it
  /// is the same for every root.
  mutable std::map<std::tuple<std::int64_t, TaskId, bool, TaskId>, std::optional<std::int64_t>> first_starts_;
  /// By rank, root, blocker and job of the root: whether the window ends before the root's next
  /// job.
  mutable std::map<std::tuple<std::int64_t, TaskId, TaskId, std::int64_t>, bool> ends_;
};

}  // namespace hotpath
