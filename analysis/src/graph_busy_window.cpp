// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/graph_busy_window.hpp"

#include <algorithm>
#include <functional>

#include "busy_query.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::ceil_div, exact::floor_div, exact::multiply, exact::subtract;

namespace {

/// Limit of nodes in cached levels; each node needs about 150 bytes.
constexpr std::size_t kMostKnownNodes = 1'000'000;

}  // namespace

GraphOrder any_order(const TaskSet& set) {
  return {std::vector<std::int64_t>(set.size(), 0), false, false, false};
}

GraphBusyWindow::GraphBusyWindow(const GraphTopology& topology, GraphOrder order,
                                 const GraphOverheads& overheads)
    : topology_(topology),
      order_(std::move(order)),
      overheads_(overheads),
      counting_(std::make_unique<Counting>(topology.size() + topology.graph().joins.size())) {
  for (TaskId id = 0; id < topology.size(); ++id) {
    const bool arrival = order_.rank[id] == GraphOrder::kArrival;
    job_work_.push_back(arrival ? 0 : add(topology.set()[id].wcet.count(), overheads_.job));
  }
  if (overheads_.release == 0) return;
  for (const TaskId timer : topology.timers()) {
    std::int64_t& work = release_work_[topology.set()[timer].period.count()];
    work = add(work, overheads_.release);
  }
}

GraphBusyWindow::~GraphBusyWindow() = default;

std::optional<std::int64_t> GraphBusyWindow::until_start(TaskId root, TaskId to) const {
  return bound(root, to, false);
}

std::optional<std::int64_t> GraphBusyWindow::until_finish(TaskId root, TaskId to) const {
  return bound(root, to, true);
}

std::optional<std::int64_t> GraphBusyWindow::response(TaskId subscription) const {
  std::int64_t largest = 0;
  for (const TaskId p : topology_.publishers(subscription)) {
    std::int64_t behind_roots = 0;
    for (const TaskId root : topology_.roots(p)) {
      // Bounds for a job that completes its join, and for a job that does not and follows
      // completing ones.
      const auto finish = until_finish(root, subscription);
      const auto start = until_start(root, subscription);
      if (!finish || !start) return std::nullopt;
      const std::int64_t published =
          add(topology_.least_until_start(root, p), topology_.set()[p].bcet.count());
      behind_roots = std::max(behind_roots, subtract(std::max(*start, *finish), published));
    }
    largest =
        std::max(largest, std::min(behind_roots, response_behind(p, subscription).value_or(behind_roots)));
  }
  // The subscription is pending in a window of its own rank.
  const std::optional<std::int64_t> own = level(order_.rank[subscription])->window;
  return own ? std::min(largest, *own) : largest;
}

/// Largest rank of the tasks on any path from `root` to `to`, with or without that of `root`.
std::int64_t GraphBusyWindow::largest_rank(TaskId root, TaskId to, bool with_root) const {
  std::vector<std::int64_t> largest(topology_.size(), kNoRank);
  largest[root] = with_root ? order_.rank[root] : kNoRank + 1;
  for (const TaskId id : topology_.order()) {
    for (const TaskId p : topology_.publishers(id)) {
      if (largest[p] != kNoRank) largest[id] = std::max({largest[id], largest[p], order_.rank[id]});
    }
  }
  return largest[to];
}

std::shared_ptr<const BusyLevel> GraphBusyWindow::level(std::int64_t rank) const {
  if (const auto known = levels_.find(rank); known != levels_.end()) return known->second;
  const auto created = std::make_shared<BusyLevel>(topology_, order_, overheads_, job_work_, rank);
  // The number of nodes in all levels of a large graph is its number of ranks times tasks.
  known_nodes_ += created->nodes.size();
  if (known_nodes_ > kMostKnownNodes) {
    levels_.clear();
    known_nodes_ = created->nodes.size();
  }
  levels_[rank] = created;
  if (created->utilisation > 1) return created;
  std::optional<std::int64_t> longest = 0;
  for (const Blocker& blocker : created->blockers) {
    Query window;
    window.level = created;
    window.blocker = blocker;
    longest = end_of_work(window, *longest);
    if (!longest) break;
  }
  created->window = longest;
  return created;
}

std::int64_t GraphBusyWindow::arrivals(std::int64_t period, std::int64_t t, bool closed,
                                       std::int64_t jitter) const {
  // Jobs that may come at any time have no work in a level that has a bound: their number is irrelevant.
  const std::int64_t until = add(add(t, overheads_.lateness), std::max<std::int64_t>(jitter, 0));
  return closed ? floor_div(until, period) + 1 : std::max<std::int64_t>(1, ceil_div(until, period));
}

std::int64_t GraphBusyWindow::releases_work(std::int64_t t) const {
  std::int64_t sum = 0;
  for (const auto& [period, work] : release_work_) sum = add(sum, multiply(arrivals(period, t, true), work));
  return sum;
}

/// Writes into query.timers the number of jobs of the level's timers released within `t` of the
/// window's start.
void GraphBusyWindow::count_timers(Query& q, std::int64_t t) const {
  q.timers.assign(1, q.level->rank);
  for (const BusyLevel::Timers& some : q.level->timers) {
    const std::int64_t jobs = arrivals(some.period, t, q.closed, some.jitter);
    q.timers.push_back(q.deadline ? std::min(jobs, urgent_jobs(some, *q.deadline)) : jobs);
  }
}

/// Work of the blocker and of all jobs of the window released within `t` of its start, without the
/// target's job.
std::int64_t GraphBusyWindow::work(Query& q, std::int64_t t) const {
  count_timers(q, t);
  return add(work_besides(q, t), work_of_jobs(q));
}

/// Work of the blocker and of the jobs resulting from query.timers.
std::int64_t GraphBusyWindow::work_of_jobs(const Query& q) const {
  const BusyLevel& in = *q.level;
  JobChange& change = counting_->change;
  const JobCounts& all = counting_->known.at(in, q.timers, change);
  counting_->all = &all;
  change.start();
  if (q.blocker.task != kNoTask) {
    for (const TaskId fed : topology_.set()[q.blocker.task].feeds) {
      if (in.inside(fed)) change.add(in.node_of[fed], 1);
    }
  }
  for (const std::size_t node : q.left_out) change.add(node, -1);
  if (q.root != kNoTask) {
    const std::size_t timers = in.timers_of[q.root];
    const std::int64_t jobs = q.timers[timers + 1];
    const std::int64_t own =
        q.deadline ? std::min(q.root_jobs, urgent_jobs(in.timers[timers], *q.deadline)) : q.root_jobs;
    change.add(in.node_of[q.root], std::max(q.later_root_jobs ? jobs : 0, own) - jobs);
  }
  const std::size_t target = q.target == kNoTask ? BusyLevel::kNone : in.node_of[q.target];
  return add(add(q.blocker.work, all.work), change.finish(in, all, target, q.works));
}

/// Least t >= `from` at which all work released before is done; std::nullopt if there is none.
std::optional<std::int64_t> GraphBusyWindow::end_of_work(Query& q, std::int64_t from) const {
  std::uint64_t steps = 0;
  std::vector<std::int64_t> counted;
  std::int64_t jobs = 0;
  const auto next = [&](std::int64_t t) {
    if (++steps > kMaxSteps) return kEndless;
    count_timers(q, t);
    if (q.timers != counted) jobs = work_of_jobs(q), counted = q.timers;
    return std::max(t, add(work_besides(q, t), jobs));
  };
  return exact::least_fixed_point(from, next, kEndless - 1);
}

/// The latest start of the target's job. `starts` holds the latest starts found with other
/// blockers, by job; if this one's start is not later, returns that of `starts`.
std::optional<std::int64_t> GraphBusyWindow::start_of(Query& q, std::int64_t from,
                                                      std::vector<std::int64_t>& starts) const {
  const auto job = static_cast<std::size_t>(q.root_jobs - 1);
  if (job == 0 && q.later_root_jobs) {
    const auto [entry, is_new] =
        first_starts_.try_emplace({q.level->rank, q.target, q.works, q.blocker.task});
    if (is_new) entry->second = end_of_work(q, from);
    return entry->second;
  }
  if (job < starts.size() && work(q, starts[job]) <= starts[job]) return starts[job];
  const auto start = end_of_work(q, from);
  if (start) {
    starts.resize(std::max(starts.size(), job + 1), 0);
    starts[job] = std::max(starts[job], *start);
  }
  return start;
}

std::int64_t GraphBusyWindow::own_work(const Query& q) const {
  const bool waits = topology_.join_of(q.target) != nullptr && !q.works;
  return waits ? overheads_.job : job_work_[q.target];
}

/// Work of those jobs of work() whose threads preempt the thread of `rank`.
std::int64_t GraphBusyWindow::preempting_work(const Query& q, std::int64_t rank) const {
  const std::int64_t above = order_.above(rank);
  const BusyLevel& in = *q.level;
  std::int64_t sum = 0;
  for (std::size_t n = 0; n < in.nodes.size(); ++n) {
    const BusyLevel::Node& node = in.nodes[n];
    const TaskId task = node.id == kNoTask ? topology_.graph().joins[node.join].inputs.front() : node.id;
    if (order_.rank[task] > above) continue;
    sum = add(sum, multiply(add(counting_->all->jobs[n], counting_->change.of(n)), node.work));
  }
  return sum;
}

/// The end of the target's work that begins at `start`. Releases interrupt it, and jobs of more urgent
/// threads, but no other job of its own thread.
std::optional<std::int64_t> GraphBusyWindow::end_after(Query& q, std::int64_t start,
                                                       std::int64_t own_work) const {
  const std::int64_t rank = order_.rank[q.target];
  const bool preempted = order_.above(rank) != kNoRank;
  std::int64_t before = releases_work(start);
  std::vector<std::int64_t> timers;
  if (preempted) {
    before = add(before, (work(q, start), preempting_work(q, rank)));
    timers = q.timers;
  }
  const std::int64_t own = add(subtract(start, before), own_work);
  const auto next = [&](std::int64_t t) {
    if (!preempted) return add(own, releases_work(t));
    q.timers = timers;
    for (std::size_t i = 0; i < q.level->timers.size(); ++i) {
      const BusyLevel::Timers& some = q.level->timers[i];
      if (some.thread >= order_.thread_of(rank) && some.thread > 0) continue;
      q.timers[i + 1] = std::max(timers[i + 1], arrivals(some.period, t, false, some.jitter));
    }
    static_cast<void>(work_of_jobs(q));
    return add(own, add(releases_work(t), preempting_work(q, rank)));
  };
  return exact::least_fixed_point(add(start, own_work), next, kEndless - 1);
}

/// Time from a timestamp `released` after the window's start to the end of the target's job that
/// begins at `start`.
std::optional<std::int64_t> GraphBusyWindow::response_to(Query& q, std::int64_t start,
                                                         std::int64_t released) const {
  const std::int64_t late = add(overheads_.lateness, order_.jitter_of(q.root));
  const auto end = end_after(q, start, own_work(q));
  if (!end) return std::nullopt;
  return subtract(*end, q.from_arrival ? std::max<std::int64_t>(0, released - late) : released - late);
}

/// Whether all work is done by `next`, when the next job of query.root is released; otherwise that
/// job belongs to the same window.
bool GraphBusyWindow::window_ends_by(const Query& q, std::int64_t next) const {
  const auto [entry, is_new] = ends_.try_emplace({q.level->rank, q.root, q.blocker.task, q.root_jobs});
  if (is_new) {
    Query rest = q;
    rest.target = kNoTask;
    rest.later_root_jobs = false;
    entry->second = work(rest, next) <= next;
  }
  return entry->second;
}

/// Largest time from a timestamp of query.root to the target's end, over all jobs of query.root in
/// the window.
std::optional<std::int64_t> GraphBusyWindow::bound(Query& q, std::vector<std::int64_t>& starts,
                                                   PathParts* parts) const {
  const std::int64_t period = topology_.set()[q.root].period.count();
  std::int64_t largest = 0, w = 0;
  for (std::uint64_t job = 0; job < kMaxSteps; ++job) {
    const std::int64_t released = multiply(static_cast<std::int64_t>(job), period);
    q.root_jobs = static_cast<std::int64_t>(job) + 1;
    const auto start = start_of(q, w, starts);
    if (!start) return std::nullopt;
    w = *start;
    const auto response = response_to(q, w, released);
    if (!response) return std::nullopt;
    if (parts != nullptr && *response > largest) {
      work(q, w);
      *parts = parts_of(q);
    }
    largest = std::max(largest, *response);
    const std::int64_t next = add(released, period) - overheads_.lateness - order_.jitter_of(q.root);
    if (next < 0) continue;
    if (*q.level->window <= next || window_ends_by(q, next)) return largest;
  }
  return std::nullopt;
}

/// The parts of the jobs that work() counted last.
PathParts GraphBusyWindow::parts_of(const Query& q) const {
  PathParts parts;
  parts.blocking = q.blocker.work;
  parts.blocker = q.blocker.longest;
  const BusyLevel& in = *q.level;
  std::vector<std::int64_t> work(in.nodes.size(), 0);
  const auto work_of = [&](std::size_t n, bool is_target) {
    const std::int64_t jobs = add(counting_->all->jobs[n], counting_->change.of(n));
    return multiply(add(jobs, is_target ? 1 : 0), in.nodes[n].work);
  };
  for (std::size_t n = 0; n < in.nodes.size(); ++n) {
    const BusyLevel::Node& node = in.nodes[n];
    if (node.id != kNoTask) {
      work[n] = work_of(n, node.id == q.target && !node.joined);
      continue;
    }
    const bool own = topology_.join_index(q.target) == node.join;
    if (const TaskId first = topology_.graph().joins[node.join].inputs.front(); in.inside(first)) {
      work[in.node_of[first]] = add(work[in.node_of[first]], work_of(n, own));
    }
  }
  for (std::size_t n = 0; n < in.nodes.size(); ++n) {
    if (work[n] > 0) parts.work.emplace_back(in.nodes[n].id, work[n]);
  }
  if (q.services > 0) parts.work.emplace_back(in.ahead(q.any_service || order_.by_deadline).task, q.services);
  std::ranges::stable_sort(parts.work, std::greater<>(), [](const auto& part) { return part.second; });
  return parts;
}

PathParts GraphBusyWindow::parts(TaskId root, TaskId to) const {
  PathParts parts;
  Query q;
  static_cast<void>(find_bound(q, root, to, &parts));
  return parts;
}

std::optional<std::int64_t> GraphBusyWindow::since_arrival(TaskId root, TaskId to, bool works) const {
  return bound(root, to, works, true);
}

std::optional<std::int64_t> GraphBusyWindow::longest_window(TaskId id) const {
  return level(order_.rank[id])->window;
}

std::optional<std::int64_t> GraphBusyWindow::bound(TaskId root, TaskId to, bool works,
                                                   bool from_arrival) const {
  const auto [entry, is_new] = known_.try_emplace({root, to, works, from_arrival});
  if (!is_new) return entry->second;
  Query q;
  q.works = works;
  q.from_arrival = from_arrival;
  return entry->second = find_bound(q, root, to, nullptr);
}

/// Whether jobs of `root` may run before an earlier one's job of `to`: not if the first task on the way
/// has a larger rank than all others, since a task's jobs run in the order of their activation.
bool GraphBusyWindow::later_jobs_precede(TaskId root, TaskId to, const BusyLevel& in) const {
  TaskId first = root;
  if (order_.rank[root] == GraphOrder::kArrival) {
    first = kNoTask;
    for (const TaskId fed : topology_.set()[root].feeds) {
      if (!in.inside(fed)) continue;
      if (first != kNoTask) return true;
      first = fed;
    }
  }
  return order_.rank[first] != in.rank || largest_rank(first, to, false) >= in.rank;
}

/// The largest bound on query.works of a job of `to`, over all blockers.
std::optional<std::int64_t> GraphBusyWindow::find_bound(Query& like, TaskId root, TaskId to,
                                                        PathParts* parts) const {
  if (order_.by_deadline) return bound_by_deadline(root, to, like.works, parts);
  const std::int64_t rank = largest_rank(root, to);
  if (rank == kNoRank) return std::nullopt;
  const std::shared_ptr<const BusyLevel> in = level(rank);
  if (!in->window) return std::nullopt;
  std::int64_t largest = 0;
  std::vector<std::int64_t> starts;
  for (const Blocker& blocker : in->blockers) {
    Query q = like;
    q.level = in;
    q.blocker = blocker;
    q.root = root;
    q.target = to;
    q.later_root_jobs = later_jobs_precede(root, to, *in);
    q.closed = blocker.work == 0 || !order_.releases_first;
    PathParts of_blocker;
    const auto response = bound(q, starts, parts ? &of_blocker : nullptr);
    if (!response) return std::nullopt;
    if (parts != nullptr && *response > largest) *parts = of_blocker;
    largest = std::max(largest, *response);
  }
  return largest;
}

}  // namespace hotpath
