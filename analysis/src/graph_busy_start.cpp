// SPDX-License-Identifier: Apache-2.0
// Busy windows that begin with the start of a timer's job: the part of the hot path behind its source.
#include <algorithm>
#include <tuple>
#include <vector>

#include "busy_query.hpp"
#include "hotpath/analysis/exact.hpp"
#include "timer_responses.hpp"

namespace hotpath {

using exact::add, exact::subtract;

/// A service runs ahead of the path of a job of `root`, and what it activates with it.
bool GraphBusyWindow::overtakes(TaskId root, TaskId to) const {
  return order_.service_wait == 0 && precedes_pending(root, to);
}

/// Whether the executor, after its decision for a job of `root`, orders the path to `to` before all that is
/// pending then; a service may still go ahead.
bool GraphBusyWindow::precedes_pending(TaskId root, TaskId to) const {
  if (order_.by_deadline) return order_.newest_first;
  return largest_rank(root, to, false) < order_.rank[root];
}

std::optional<std::int64_t> GraphBusyWindow::precedence(TaskId first, TaskId to, TaskId root) const {
  // A timestamp at which the executor may already have decided for the job of `root` is too late.
  const std::int64_t visible = add(overheads_.lateness, order_.releases_first ? 0 : 1);
  if (!order_.by_deadline) {
    return largest_rank(first, to) < order_.rank[root] ? std::optional(visible) : std::nullopt;
  }
  if (!order_.newest_first) return std::nullopt;
  const std::int64_t later = topology_.set()[first].deadline.count() - topology_.set()[root].deadline.count();
  return std::max(visible, add(later, first < root ? 0 : 1));
}

/// The tasks from `root` to `to`, both included; empty if there are several paths.
std::vector<TaskId> GraphBusyWindow::only_path(TaskId root, TaskId to) const {
  std::vector<TaskId> path = {to};
  while (path.back() != root) {
    TaskId before = kNoTask;
    for (const TaskId p : topology_.publishers(path.back())) {
      if (!topology_.leads_to(root, p)) continue;
      if (before != kNoTask) return {};
      before = p;
    }
    path.push_back(before);
  }
  std::ranges::reverse(path);
  return path;
}

/// The tasks that a job of the only path from `root` to `to` activates, and that run behind the path:
/// among equals the last one activated goes first (docs/chain_bounds.md, "Hot path"), if the order of
/// delivery is known. Empty if there are several paths, or if a rank on the path is larger than one
/// before.
std::vector<TaskId> GraphBusyWindow::left_behind(TaskId root, TaskId to) const {
  if (!order_.newest_first) return {};
  const std::vector<TaskId> path = only_path(root, to);
  std::vector<TaskId> behind;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const std::int64_t rank = order_.rank[path[i]];
    if (order_.rank[path[i - 1]] < rank) return {};
    bool earlier = topology_.graph().delivery_known;
    for (const TaskId fed : topology_.set()[path[i - 1]].feeds) {
      if (fed == path[i]) earlier = false;
      const bool yields = order_.rank[fed] > rank || (order_.rank[fed] == rank && earlier);
      if (fed != path[i] && yields && !runs_ahead(fed)) behind.push_back(fed);
    }
  }
  return behind;
}

/// The jobs between the decision for a job of `root`, which overtakes what is pending then, and the
/// start of the job of `to`. The job of `root` is their blocker.
std::optional<GraphBusyWindow::Query> GraphBusyWindow::query_from_start(TaskId root, TaskId to) const {
  if (!precedes_pending(root, to)) return std::nullopt;
  Query q;
  // While the job of `root` runs, every more urgent thread preempts it.
  const std::int64_t rank = std::max(largest_rank(root, to, false), order_.above(order_.rank[root]));
  q.level = level(order_.by_deadline ? order_.rank[root] : rank);
  q.blocker = {root, root, job_work_[root]};
  q.target = to;
  q.closed = !order_.releases_first;
  for (const TaskId id : left_behind(root, to)) {
    if (q.level->inside(id)) q.left_out.push_back(q.level->node_of[id]);
  }
  if (q.level->utilisation == BusyLevel::kInfinite) return std::nullopt;
  if (order_.by_deadline) limit_to_deadline(q, root);
  return q;
}

/// Of the jobs released behind the query's blocker, which has the deadline of a job of `root`, only those
/// with deadlines up to it.
void GraphBusyWindow::limit_to_deadline(Query& q, TaskId root) const {
  q.root = root;
  q.later_root_jobs = false;
  q.deadline = topology_.set()[root].deadline.count() + (q.closed ? overheads_.lateness : -1);
}

/// From the end of a job of `publisher` to the end of the job of `subscription` that it activates, if this
/// job precedes all that was pending at the start of the publisher's (docs/response_bounds.md, "Response
/// time of a subscription"). std::nullopt: not known.
std::optional<std::int64_t> GraphBusyWindow::response_behind(TaskId publisher, TaskId subscription) const {
  const std::int64_t rank = order_.rank[subscription];
  const std::vector<TaskId>& roots = topology_.roots(publisher);
  const auto precedes = [&](TaskId id) { return order_.rank[id] <= rank; };
  // A service may be chosen while more urgent jobs are pending.
  if (!order_.threads.empty() || runs_ahead(publisher)) return std::nullopt;
  // A service with the publisher's deadline may be pending; what it activates is newer than the
  // subscription's job. A timer only runs after all pending subscriptions with its deadline.
  const bool of_timer = topology_.set()[publisher].kind == TaskKind::timer;
  if (order_.by_deadline && order_.service_wait > 0 && !of_timer) return std::nullopt;
  if (order_.by_deadline || order_.rank[publisher] <= rank) {
    if (!order_.newest_first || !topology_.one_publisher(subscription)) return std::nullopt;
    const bool ranked = order_.rank[publisher] == rank && std::ranges::none_of(roots, precedes);
    if (!order_.by_deadline && !ranked) return std::nullopt;
  }
  Query q;
  q.level = level(rank);
  q.blocker = {publisher, publisher, job_work_[publisher]};
  q.target = subscription;
  q.any_service = true;  // also one that was pending before, with the subscription's rank
  q.closed = !order_.releases_first;
  for (const TaskId fed : topology_.set()[publisher].feeds) {
    if (fed == subscription || !order_.newest_first || !topology_.graph().delivery_known) break;
    if (order_.rank[fed] == rank && !runs_ahead(fed)) q.left_out.push_back(q.level->node_of[fed]);
  }
  std::int64_t largest = 0;
  for (const TaskId root : order_.by_deadline ? roots : std::vector<TaskId>{kNoTask}) {
    if (order_.by_deadline) limit_to_deadline(q, root);
    for (const bool works : {true, false}) {
      q.works = works;
      const auto start = end_of_work(q, 0);
      const auto end = start ? end_after(q, *start, own_work(q)) : std::nullopt;
      if (!end) return std::nullopt;
      largest = std::max(largest, subtract(*end, q.blocker.work));
      if (topology_.join_of(subscription) == nullptr) break;
    }
  }
  return largest;
}

std::optional<std::int64_t> GraphBusyWindow::start_to_start(TaskId root, TaskId to) const {
  if (root == to) return 0;
  if (auto q = query_from_start(root, to)) {
    if (const auto start = end_of_work(*q, 0)) return end_after(*q, *start, overheads_.job);
  }
  const auto finish = until_finish(root, to);
  return finish ? std::optional(subtract(*finish, topology_.set()[to].bcet.count())) : std::nullopt;
}

std::optional<std::int64_t> GraphBusyWindow::later_start_to_start(TaskId root, TaskId to, TaskId other,
                                                                  TaskId input, TaskId meets) const {
  const std::vector<TaskId> path = only_path(root, to);
  const auto join = std::ranges::find(path, meets);
  auto all = query_from_start(root, to);
  // Jobs of `other` overtake the path on their way to `input`, and none starts behind the join.
  const auto precedes = [&](TaskId id) { return order_.rank[other] <= order_.rank[id]; };
  if (order_.by_deadline || !order_.threads.empty() || !all || join == path.end() ||
      !all->level->inside(other) || !overtakes(other, input) || std::any_of(join + 1, path.end(), precedes)) {
    return std::nullopt;
  }
  Query none = *all;  // Case 1: no job of `other` starts before the join is complete.
  none.root = other;
  none.later_root_jobs = false;
  const auto whole = end_of_work(*all, 0), without = end_of_work(none, 0);
  if (!whole || !without) return std::nullopt;
  // Case 2: some job does, behind the job of `root`; behind the next one, too, if that one starts at
  // the same instant.
  std::int64_t before = job_work_[root];
  if (before == 0 && !all->closed && topology_.set()[root].feeds.size() == 1) {
    if (path[1] == meets) return end_after(none, *without, overheads_.job);
    if (topology_.join_of(path[1]) == nullptr) before = job_work_[path[1]];
  }
  const auto later = end_after(none, *without, overheads_.job), end = end_after(*all, *whole, overheads_.job);
  return later && end ? std::optional(std::max(*later, subtract(*end, before))) : std::nullopt;
}

std::optional<std::int64_t> GraphBusyWindow::start_to_finish(TaskId root, TaskId to) const {
  if (root == to && order_.above(order_.rank[root]) == kNoRank) {
    Query q;
    q.target = root;
    return end_after(q, 0, job_work_[root]);
  }
  if (root == to) return until_finish(root, to);
  if (auto q = query_from_start(root, to)) {
    if (const auto start = end_of_work(*q, 0)) return end_after(*q, *start, job_work_[to]);
  }
  return until_finish(root, to);
}

GraphOrder priority_ranks(const BoundedSystem& system) {
  const TaskSet& set = system.graph.set;
  const SchedulerOptions& options = system.scheduling;
  const PriorityOrder order(set, system.executor.traits.queue_order(), options.rule, options.ties);
  using Key = std::tuple<std::int64_t, bool, TaskId>;
  std::vector<Key> keys;
  for (TaskId id = 0; id < set.size(); ++id) {
    const bool timer = set[id].kind == TaskKind::timer && options.ties == Ties::lifo;
    keys.emplace_back(order.level(id), timer, timer ? id : 0);
  }
  std::vector<Key> sorted = keys;
  std::sort(sorted.begin(), sorted.end());
  GraphOrder ranks;
  for (const Key& key : keys) {
    ranks.rank.push_back(std::lower_bound(sorted.begin(), sorted.end(), key) - sorted.begin());
  }
  ranks.newest_first = options.ties == Ties::lifo;
  return ranks;
}

}  // namespace hotpath
