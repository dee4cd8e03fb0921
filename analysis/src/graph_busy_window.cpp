// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/graph_busy_window.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::ceil_div, exact::floor_div, exact::multiply, exact::subtract;

namespace {

/// Windows with more jobs of their timer, or steps to their end, count as endless: the utilisation is next to
/// 1.
constexpr std::uint64_t kMaxSteps = 10'000;
constexpr std::int64_t kEndless = std::int64_t{1} << 60;
constexpr std::int64_t kNoRank = std::numeric_limits<std::int64_t>::min();

}  // namespace

GraphOrder any_order(const TaskSet& set) {
  return {std::vector<std::int64_t>(set.size(), 0), false, false};
}

/// A window of jobs of rank `rank` or before, and what in it is looked for.
struct GraphBusyWindow::Query {
  std::int64_t rank = 0;
  Blocker blocker;
  TaskId root = kNoTask, target = kNoTask;  ///< None: the window itself.
  bool works = true;                        ///< The target's job completes its join, if it has one.
  bool later_root_jobs = true;              ///< Jobs of `root` behind the one looked at may precede.
  std::int64_t root_jobs = 0;               ///< Of `root`, up to the one looked at.
  bool closed = true;                       ///< What is released at the end of an interval counts.
  std::vector<std::int64_t> jobs;           ///< By task; for work().
};

GraphBusyWindow::GraphBusyWindow(const GraphTopology& topology, GraphOrder order,
                                 const GraphOverheads& overheads)
    : topology_(topology), order_(std::move(order)), overheads_(overheads) {
  assert(overheads.delivery == 0);
}

std::optional<std::int64_t> GraphBusyWindow::until_start(TaskId root, TaskId to) const {
  return bound(root, to, false);
}

std::optional<std::int64_t> GraphBusyWindow::until_finish(TaskId root, TaskId to) const {
  return bound(root, to, true);
}

std::optional<std::int64_t> GraphBusyWindow::response(TaskId subscription) const {
  std::optional<std::int64_t> largest = 0;
  for (const TaskId p : topology_.publishers(subscription)) {
    for (const TaskId root : topology_.roots(p)) {
      const auto finish = until_finish(root, subscription);
      if (!finish) return std::nullopt;
      const std::int64_t published =
          add(topology_.least_until_start(root, p), topology_.set()[p].bcet.count());
      largest = std::max(*largest, subtract(*finish, published));
    }
  }
  return largest;
}

/// Of the tasks on any way from `root` to `to`.
std::int64_t GraphBusyWindow::largest_rank(TaskId root, TaskId to) const {
  std::vector<std::int64_t> largest(topology_.size(), kNoRank);
  largest[root] = order_.rank[root];
  for (const TaskId id : topology_.order()) {
    for (const TaskId p : topology_.publishers(id)) {
      if (largest[p] != kNoRank) largest[id] = std::max({largest[id], largest[p], order_.rank[id]});
    }
  }
  return largest[to];
}

std::int64_t GraphBusyWindow::job_work(TaskId id) const {
  return add(topology_.set()[id].wcet.count(), overheads_.job);
}

/// The jobs outside of the window that may run when it begins: those that activate something in it, and the
/// longest of the others.
std::vector<GraphBusyWindow::Blocker> GraphBusyWindow::blockers(std::int64_t rank) const {
  std::vector<Blocker> all = {{kNoTask, 0}};
  for (TaskId id = 0; id < topology_.size(); ++id) {
    if (inside(id, rank) || topology_.roots(id).empty()) continue;
    const std::vector<TaskId>& feeds = topology_.set()[id].feeds;
    if (std::any_of(feeds.begin(), feeds.end(), [&](TaskId fed) { return inside(fed, rank); })) {
      all.push_back({id, job_work(id)});
    } else {
      all.front().work = std::max(all.front().work, job_work(id));
    }
  }
  for (Blocker& b : all) b.work = std::max(b.work, overheads_.wake_up);
  return all;
}

/// Long-run work of the window's jobs per time.
double GraphBusyWindow::utilisation(std::int64_t rank) const {
  std::vector<double> rate(topology_.size(), 0);
  std::vector<double> slowest(topology_.graph().joins.size());
  double sum = 0;
  for (std::size_t j = 0; j < slowest.size(); ++j) slowest[j] = std::numeric_limits<double>::max();
  for (const TaskId id : topology_.order()) {
    const Task& task = topology_.set()[id];
    const double releases = task.kind == TaskKind::timer ? 1.0 / static_cast<double>(task.period.count()) : 0;
    sum += releases * static_cast<double>(overheads_.release);
    const auto* join = topology_.join_of(id);
    if (inside(id, rank)) {
      rate[id] = releases;
      std::vector<std::size_t> counted;
      for (const TaskId p : topology_.publishers(id)) {
        const std::size_t j = topology_.join_index(p);
        if (j == slowest.size()) {
          rate[id] += rate[p];
        } else if (std::find(counted.begin(), counted.end(), j) == counted.end()) {
          counted.push_back(j);
          rate[id] += slowest[j];
        }
      }
      sum += rate[id] * static_cast<double>(join ? overheads_.job : job_work(id));
    }
    if (join == nullptr) continue;
    double& output = slowest[topology_.join_index(id)];
    output = std::min(output, rate[id]);
  }
  for (std::size_t j = 0; j < slowest.size(); ++j) {
    const TaskId any = topology_.graph().joins[j].inputs.front();
    sum += slowest[j] * static_cast<double>(topology_.set()[any].wcet.count());
  }
  return sum;
}

/// Most jobs of the join's inputs that complete it: at the start of the window one of them has no sample, the
/// others may have one.
std::int64_t GraphBusyWindow::join_output(std::size_t join, const std::vector<std::int64_t>& jobs,
                                          std::int64_t rank) const {
  const std::vector<TaskId>& inputs = topology_.graph().joins[join].inputs;
  const auto of = [&](TaskId id) { return inside(id, rank) ? jobs[id] : 0; };
  std::int64_t most = 0;
  for (const TaskId without : inputs) {
    std::int64_t least = of(without);
    for (const TaskId other : inputs) {
      if (other != without) least = std::min(least, of(other) + 1);
    }
    most = std::max(most, least);
  }
  return most;
}

std::int64_t GraphBusyWindow::arrivals(TaskId timer, std::int64_t t, bool closed) const {
  const std::int64_t period = topology_.set()[timer].period.count();
  const std::int64_t until = add(t, overheads_.lateness);
  return closed ? floor_div(until, period) + 1 : std::max<std::int64_t>(1, ceil_div(until, period));
}

std::int64_t GraphBusyWindow::releases_work(std::int64_t t) const {
  std::int64_t sum = 0;
  if (overheads_.release == 0) return sum;
  for (const TaskId timer : topology_.timers()) {
    sum = add(sum, multiply(arrivals(timer, t, true), overheads_.release));
  }
  return sum;
}

/// Of the blocker and of all jobs of the window that are released within `t` of its start, without the
/// target's own.
std::int64_t GraphBusyWindow::work(Query& q, std::int64_t t) const {
  const std::vector<CallbackGraph::Join>& joins = topology_.graph().joins;
  q.jobs.assign(topology_.size(), 0);
  std::int64_t sum = add(q.blocker.work, releases_work(t));
  std::vector<std::int64_t> output(joins.size(), -1);
  if (q.blocker.task != kNoTask) {
    for (const TaskId fed : topology_.set()[q.blocker.task].feeds) q.jobs[fed] = 1;
  }
  const auto output_of = [&](std::size_t j) {
    if (output[j] >= 0) return output[j];
    std::int64_t most = join_output(j, q.jobs, q.rank);
    const bool own = q.target != kNoTask && topology_.join_index(q.target) == j && q.works;
    output[j] = own ? std::max<std::int64_t>(0, most - 1) : most;
    const TaskId any = joins[j].inputs.front();
    sum = add(sum, multiply(output[j], topology_.set()[any].wcet.count()));
    return output[j];
  };
  for (const TaskId id : topology_.order()) {
    if (!inside(id, q.rank)) continue;
    if (topology_.set()[id].kind == TaskKind::timer) {
      std::int64_t released = arrivals(id, t, q.closed);
      if (id == q.root) released = q.later_root_jobs ? std::max(released, q.root_jobs) : q.root_jobs;
      q.jobs[id] = add(q.jobs[id], released);
    }
    std::size_t counted = joins.size();
    for (const TaskId p : topology_.publishers(id)) {
      const std::size_t j = topology_.join_index(p);
      if (j == joins.size()) {
        if (inside(p, q.rank)) q.jobs[id] = add(q.jobs[id], q.jobs[p] - (p == q.target ? 1 : 0));
      } else if (j != counted) {
        counted = j;  // publishers of a topic are listed join by join
        q.jobs[id] = add(q.jobs[id], output_of(j));
      }
    }
    const std::int64_t others = q.jobs[id] - (id == q.target ? 1 : 0);
    sum = add(sum, multiply(others, topology_.join_of(id) ? overheads_.job : job_work(id)));
  }
  for (std::size_t j = 0; j < joins.size(); ++j) output_of(j);
  return sum;
}

/// Least t >= `from` at which all work released before is done; none if that takes for ever.
std::optional<std::int64_t> GraphBusyWindow::end_of_work(Query& q, std::int64_t from) const {
  std::uint64_t steps = 0;
  const auto next = [&](std::int64_t t) { return ++steps > kMaxSteps ? kEndless : std::max(t, work(q, t)); };
  return exact::least_fixed_point(from, next, kEndless - 1);
}

/// Largest time from a timestamp of query.root to the target's end, over all its jobs in the window.
std::optional<std::int64_t> GraphBusyWindow::bound(Query& q) const {
  const std::int64_t period = topology_.set()[q.root].period.count();
  const bool waits = topology_.join_of(q.target) != nullptr && !q.works;
  const std::int64_t own = waits ? overheads_.job : job_work(q.target);
  std::int64_t largest = 0, w = 0;
  for (std::uint64_t job = 0; job < kMaxSteps; ++job) {
    const std::int64_t released = multiply(static_cast<std::int64_t>(job), period);
    q.root_jobs = static_cast<std::int64_t>(job) + 1;
    const auto start = end_of_work(q, w);
    if (!start) return std::nullopt;
    w = *start;
    // Releases interrupt the job itself as well.
    const std::int64_t before = subtract(w, releases_work(w));
    const std::int64_t finish = *exact::least_fixed_point(
        add(w, own), [&](std::int64_t t) { return add(add(before, own), releases_work(t)); });
    largest = std::max(largest, add(subtract(finish, released), overheads_.lateness));
    // The next job is in the same window if it is released before all the rest is done.
    Query rest = q;
    rest.target = kNoTask;
    rest.later_root_jobs = false;
    const auto end = end_of_work(rest, 0);
    if (!end) return std::nullopt;
    if (*end <= add(released, period) - overheads_.lateness) return largest;
  }
  return std::nullopt;
}

std::optional<std::int64_t> GraphBusyWindow::bound(TaskId root, TaskId to, bool works) const {
  const std::int64_t rank = largest_rank(root, to);
  if (rank == kNoRank || utilisation(rank) > 1) return std::nullopt;
  std::int64_t largest = 0;
  for (const Blocker& blocker : blockers(rank)) {
    Query q;
    q.rank = rank;
    q.blocker = blocker;
    q.root = root;
    q.target = to;
    q.works = works;
    q.later_root_jobs = !(order_.timers_behind_equals && order_.rank[root] == rank);
    q.closed = blocker.work == 0 || !order_.releases_first;
    const auto found = bound(q);
    if (!found) return std::nullopt;
    largest = std::max(largest, *found);
  }
  return largest;
}

}  // namespace hotpath
