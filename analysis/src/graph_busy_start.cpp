// SPDX-License-Identifier: Apache-2.0
// Busy windows that begin with the start of a timer's job: the part of the hot path behind its source.
#include <algorithm>

#include "busy_query.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::subtract;

bool GraphBusyWindow::overtakes(TaskId root, TaskId to) const {
  if (order_.by_deadline) return order_.timers_behind_equals;
  return largest_rank(root, to, false) < order_.rank[root];
}

std::optional<std::int64_t> GraphBusyWindow::precedence(TaskId first, TaskId to, TaskId root) const {
  // A timestamp at which the executor may already have decided for the job of `root` is too late.
  const std::int64_t visible = add(overheads_.lateness, order_.releases_first ? 0 : 1);
  if (!order_.by_deadline) {
    return largest_rank(first, to) < order_.rank[root] ? std::optional(visible) : std::nullopt;
  }
  if (!order_.timers_behind_equals) return std::nullopt;
  const std::int64_t later = topology_.set()[first].deadline.count() - topology_.set()[root].deadline.count();
  return std::max(visible, add(later, first < root ? 0 : 1));
}

/// The tasks that a job of the only path from `root` to `to` activates, and that run behind the path:
/// among equals the last one activated goes first (docs/analysis.md, "Hot path"). Empty if there are
/// several paths, or if a rank on the path is larger than one before.
std::vector<TaskId> GraphBusyWindow::left_behind(TaskId root, TaskId to) const {
  if (!order_.timers_behind_equals) return {};
  std::vector<TaskId> behind;
  for (TaskId id = to; id != root;) {
    TaskId before = kNoTask;
    for (const TaskId p : topology_.publishers(id)) {
      if (!std::ranges::binary_search(topology_.roots(p), root)) continue;
      if (before != kNoTask) return {};
      before = p;
    }
    if (order_.rank[before] < order_.rank[id]) return {};
    bool earlier = true;
    for (const TaskId fed : topology_.set()[before].feeds) {
      if (fed == id) earlier = false;
      const std::int64_t later_rank = order_.rank[fed] - order_.rank[id];
      if (fed != id && (later_rank > 0 || (later_rank == 0 && earlier))) behind.push_back(fed);
    }
    id = before;
  }
  return behind;
}

/// The jobs between the decision for a job of `root`, which overtakes what is pending then, and the
/// start of the job of `to`. The job of `root` is their blocker.
std::optional<GraphBusyWindow::Query> GraphBusyWindow::query_from_start(TaskId root, TaskId to) const {
  if (!overtakes(root, to)) return std::nullopt;
  Query q;
  q.level = level(order_.by_deadline ? order_.rank[root] : largest_rank(root, to, false));
  q.blocker = {root, root, job_work(root)};
  q.target = to;
  q.closed = !order_.releases_first;
  for (const TaskId id : left_behind(root, to)) {
    if (q.level->inside(id)) q.left_out.push_back(q.level->node_of[id]);
  }
  if (order_.by_deadline) {
    // Of the jobs released later, only those with deadlines up to that of the path.
    q.root = root;
    q.later_root_jobs = false;
    q.deadline = topology_.set()[root].deadline.count() + (q.closed ? overheads_.lateness : -1);
  }
  return q;
}

std::optional<std::int64_t> GraphBusyWindow::start_to_start(TaskId root, TaskId to) const {
  if (root == to) return 0;
  if (auto q = query_from_start(root, to)) {
    if (const auto start = end_of_work(*q, 0)) return end_after(*start, overheads_.job);
  }
  const auto finish = until_finish(root, to);
  return finish ? std::optional(subtract(*finish, topology_.set()[to].bcet.count())) : std::nullopt;
}

std::optional<std::int64_t> GraphBusyWindow::start_to_finish(TaskId root, TaskId to) const {
  if (root == to) return end_after(0, job_work(root));
  if (auto q = query_from_start(root, to)) {
    if (const auto start = end_of_work(*q, 0)) return end_after(*start, job_work(to));
  }
  return until_finish(root, to);
}

}  // namespace hotpath
