// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "busy_query.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::ceil_div;

namespace {

/// With more steps than this, several steps of a deadline are combined.
constexpr std::size_t kMaxDeadlineSteps = 32;

}  // namespace

/// The longest job that may have started with a deadline later than `deadline` after the window's
/// start.
Blocker GraphBusyWindow::blocker_behind(std::int64_t deadline) const {
  Blocker longest{kNoTask, kNoTask, overheads_.wake_up};
  for (TaskId id = 0; id < topology_.size(); ++id) {
    const auto later = [&](TaskId timer) { return topology_.set()[timer].deadline.count() > deadline; };
    if (job_work_[id] <= longest.work || !std::ranges::any_of(topology_.roots(id), later)) continue;
    longest.longest = id;
    longest.work = job_work_[id];
  }
  return longest;
}

/// The deadline steps of `root`; std::nullopt if the window has no end. A step begins where the
/// root's deadline equals the deadline of another timer's job; many steps are combined.
const std::optional<std::vector<GraphBusyWindow::DeadlineStep>>& GraphBusyWindow::deadline_steps(
    TaskId root) const {
  const auto [entry, is_new] = steps_.try_emplace(root);
  if (!is_new) return entry->second;
  Query whole;
  whole.level = level(order_.rank[root]);
  // A window after the longest job is no longer than a window that contains that job twice.
  whole.blocker = blocker_behind(-overheads_.lateness - 1);
  const auto until = whole.level->window ? end_of_work(whole, 0) : std::nullopt;
  if (!until) return entry->second;
  const std::int64_t own = topology_.set()[root].deadline.count();
  const std::vector<std::int64_t> starts = deadline_starts(root, *until);
  std::vector<DeadlineStep> steps;
  const std::size_t stride = ceil_div(static_cast<std::int64_t>(starts.size()), kMaxDeadlineSteps);
  for (std::size_t i = 0; i < starts.size(); i += stride) {
    const std::int64_t last = i + stride < starts.size() ? starts[i + stride] - 1 : *until;
    steps.push_back({starts[i], last, blocker_behind(add(starts[i], own) - overheads_.lateness), 0});
    Query all = query(root, steps.back());
    const auto end = end_of_work(all, 0);
    steps.back().end = end ? *end : kEndless;
  }
  entry->second = std::move(steps);
  return entry->second;
}

/// Timestamps of `root`, after the window's start, at which its deadline equals the deadline of
/// another timer's job.
std::vector<std::int64_t> GraphBusyWindow::deadline_starts(TaskId root, std::int64_t until) const {
  std::vector<std::int64_t> all = {0};
  const std::int64_t own = topology_.set()[root].deadline.count();
  for (const TaskId timer : topology_.timers()) {
    const Task& task = topology_.set()[timer];
    const std::int64_t period = task.period.count();
    std::int64_t first = task.deadline.count() - own;
    if (first < 0) first += ceil_div(-first, period) * period;
    for (std::int64_t a = first; a < until; a = add(a, period)) {
      if (all.size() == kMaxSteps) return {0};
      all.push_back(a);
    }
  }
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

/// The query for the jobs of `root` released in the step.
GraphBusyWindow::Query GraphBusyWindow::query(TaskId root, const DeadlineStep& step) const {
  const Task& task = topology_.set()[root];
  Query q;
  q.level = level(order_.rank[root]);
  q.root = root;
  q.later_root_jobs = false;
  q.deadline = add(step.last, task.deadline.count());
  q.root_jobs = step.last / task.period.count() + 1;
  q.blocker = step.blocker;
  q.closed = step.blocker.work == 0 || !order_.releases_first;
  return q;
}

/// Like Spuri 1996 for timers: only jobs with deadlines up to the path's deadline precede it.
std::optional<std::int64_t> GraphBusyWindow::bound_by_deadline(TaskId root, TaskId to, bool works,
                                                               PathParts* parts) const {
  const auto& steps = deadline_steps(root);
  if (largest_rank(root, to) == kNoRank || !steps) return std::nullopt;
  std::int64_t largest = 0;
  for (const DeadlineStep& step : *steps) {
    if (step.end - step.first + overheads_.lateness <= largest) continue;
    Query q = query(root, step);
    q.target = to;
    q.works = works;
    const std::int64_t known = largest - overheads_.lateness + step.first - own_work(q);
    if (known >= 0 && overheads_.release == 0 && work(q, known) <= known) continue;
    const auto start = end_of_work(q, 0);
    if (!start) return std::nullopt;
    const auto response = response_to(q, *start, step.first);
    if (!response) return std::nullopt;
    if (*response <= largest) continue;
    largest = *response;
    work(q, *start);
    if (parts != nullptr) *parts = parts_of(q);
  }
  return largest;
}

}  // namespace hotpath
