// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/graph_busy_window.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::ceil_div, exact::floor_div, exact::multiply, exact::subtract;

namespace {

/// Windows with more jobs of their timer, or steps to their end, count as endless: the utilisation is next to
/// 1.
constexpr std::uint64_t kMaxSteps = 10'000;
constexpr std::int64_t kEndless = std::int64_t{1} << 60;
/// Above so many steps of a deadline several are taken together.
constexpr std::size_t kMaxDeadlineSteps = 32;
constexpr std::int64_t kNoRank = std::numeric_limits<std::int64_t>::min();

/// Jobs of a timer released from 0 on whose deadlines are not later.
std::int64_t urgent_jobs(const Task& timer, std::int64_t deadline) {
  const std::int64_t latest = deadline - timer.deadline.count();
  return latest < 0 ? 0 : latest / timer.period.count() + 1;
}

}  // namespace

GraphOrder any_order(const TaskSet& set) {
  return {std::vector<std::int64_t>(set.size(), 0), false, false, false};
}

/// What is looked for in the windows of a level.
struct GraphBusyWindow::Query {
  const Level* level = nullptr;
  Blocker blocker;
  TaskId root = kNoTask, target = kNoTask;  ///< None: the window itself.
  bool works = true;                        ///< The target's job completes its join, if it has one.
  bool later_root_jobs = true;              ///< Jobs of `root` behind the one looked at may precede.
  std::int64_t root_jobs = 0;               ///< Of `root`, up to the one looked at.
  bool closed = true;                       ///< What is released at the end of an interval counts.
  std::optional<std::int64_t> deadline;     ///< Behind the window's start: later ones do not precede.
  std::vector<std::int64_t> jobs, outputs;  ///< By task and by join; for work().
};

GraphBusyWindow::GraphBusyWindow(const GraphTopology& topology, GraphOrder order,
                                 const GraphOverheads& overheads)
    : topology_(topology), order_(std::move(order)), overheads_(overheads) {}

std::optional<std::int64_t> GraphBusyWindow::until_start(TaskId root, TaskId to) const {
  return bound(root, to, false);
}

std::optional<std::int64_t> GraphBusyWindow::until_finish(TaskId root, TaskId to) const {
  return bound(root, to, true);
}

std::optional<std::int64_t> GraphBusyWindow::response(TaskId subscription) const {
  std::int64_t largest = 0;
  for (const TaskId p : topology_.publishers(subscription)) {
    for (const TaskId root : topology_.roots(p)) {
      // Of a job that completes its join, and of one that does not, behind others that do.
      const auto finish = until_finish(root, subscription);
      const auto start = until_start(root, subscription);
      if (!finish || !start) return std::nullopt;
      const std::int64_t published =
          add(topology_.least_until_start(root, p), topology_.set()[p].bcet.count());
      largest = std::max(largest, subtract(std::max(*start, *finish), published));
    }
  }
  // It is pending in a window of its own rank.
  const Level& own = level(order_.rank[subscription]);
  return own.window ? std::min(largest, *own.window) : largest;
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

/// Of those with the same effect the longest.
std::vector<GraphBusyWindow::Blocker> GraphBusyWindow::blockers(std::int64_t rank) const {
  std::map<std::vector<TaskId>, Blocker> longest = {{{}, Blocker{kNoTask, kNoTask, overheads_.wake_up}}};
  for (TaskId id = 0; id < topology_.size(); ++id) {
    if (inside(id, rank) || topology_.roots(id).empty()) continue;
    std::vector<TaskId> activated;
    for (const TaskId fed : topology_.set()[id].feeds) {
      if (inside(fed, rank)) activated.push_back(fed);
    }
    Blocker& blocker = longest[activated];
    if (!activated.empty()) blocker.task = id;
    if (job_work(id) > blocker.work) blocker.longest = id;
    blocker.work = std::max({blocker.work, job_work(id), overheads_.wake_up});
  }
  std::vector<Blocker> all;
  for (const auto& [activated, blocker] : longest) all.push_back(blocker);
  return all;
}

const GraphBusyWindow::Level& GraphBusyWindow::level(std::int64_t rank) const {
  const auto [entry, is_new] = levels_.try_emplace(rank);
  Level& level = entry->second;
  if (!is_new) return level;
  level.rank = rank;
  for (const TaskId id : topology_.order()) {
    if (inside(id, rank)) level.members.push_back(member(id, rank));
  }
  const std::vector<CallbackGraph::Join>& joins = topology_.graph().joins;
  for (std::size_t j = 0; j < joins.size(); ++j) {
    if (std::ranges::any_of(joins[j].inputs, [&](TaskId id) { return inside(id, rank); }))
      level.joins.push_back(j);
  }
  if (utilisation(level) > 1) return level;
  level.blockers = blockers(rank);
  level.window = 0;
  for (const Blocker& blocker : level.blockers) {
    Query window;
    window.level = &level;
    window.blocker = blocker;
    level.window = end_of_work(window, *level.window);
    if (!level.window) break;
  }
  return level;
}

GraphBusyWindow::Member GraphBusyWindow::member(TaskId id, std::int64_t rank) const {
  Member m;
  m.id = id;
  const Task& task = topology_.set()[id];
  if (task.kind == TaskKind::timer) m.period = task.period.count();
  m.work = topology_.join_of(id) ? overheads_.job : job_work(id);
  for (const TaskId p : topology_.publishers(id)) {
    const std::size_t j = topology_.join_index(p);
    if (topology_.join_of(p) == nullptr) {
      if (inside(p, rank)) m.publishers.push_back(p);
    } else if (std::find(m.joins.begin(), m.joins.end(), j) == m.joins.end()) {
      m.joins.push_back(j);
    }
  }
  return m;
}

/// Long-run work of the level's jobs per time.
double GraphBusyWindow::utilisation(const Level& level) const {
  std::vector<double> rate(topology_.size(), 0);
  double sum = 0;
  const auto slowest = [&](std::size_t join) {
    double least = std::numeric_limits<double>::max();
    for (const TaskId input : topology_.graph().joins[join].inputs) least = std::min(least, rate[input]);
    return least;
  };
  for (const TaskId timer : topology_.timers()) {
    sum +=
        static_cast<double>(overheads_.release) / static_cast<double>(topology_.set()[timer].period.count());
  }
  for (const Member& m : level.members) {
    if (m.period > 0) rate[m.id] += 1.0 / static_cast<double>(m.period);
    for (const TaskId p : m.publishers) rate[m.id] += rate[p];
    for (const std::size_t j : m.joins) rate[m.id] += slowest(j);
    sum += rate[m.id] * static_cast<double>(m.work);
  }
  for (const std::size_t j : level.joins) sum += slowest(j) * static_cast<double>(topology_.join_work(j));
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

std::int64_t GraphBusyWindow::arrivals(std::int64_t period, std::int64_t t, bool closed) const {
  const std::int64_t until = add(t, overheads_.lateness);
  return closed ? floor_div(until, period) + 1 : std::max<std::int64_t>(1, ceil_div(until, period));
}

std::int64_t GraphBusyWindow::releases_work(std::int64_t t) const {
  std::int64_t sum = 0;
  if (overheads_.release == 0) return sum;
  for (const TaskId timer : topology_.timers()) {
    sum = add(sum, multiply(arrivals(topology_.set()[timer].period.count(), t, true), overheads_.release));
  }
  return sum;
}

/// Of the blocker and of all jobs of the window that are released within `t` of its start, without the
/// target's own.
std::int64_t GraphBusyWindow::work(Query& q, std::int64_t t) const {
  constexpr std::int64_t kUnknown = -1;
  const std::vector<CallbackGraph::Join>& joins = topology_.graph().joins;
  q.jobs.assign(topology_.size(), 0);
  q.outputs.assign(joins.size(), kUnknown);
  std::int64_t sum = add(q.blocker.work, releases_work(t));
  if (q.blocker.task != kNoTask) {
    for (const TaskId fed : topology_.set()[q.blocker.task].feeds) q.jobs[fed] = 1;
  }
  const auto output_of = [&](std::size_t j) {
    if (q.outputs[j] != kUnknown) return q.outputs[j];
    const bool own = q.target != kNoTask && topology_.join_index(q.target) == j && q.works;
    const std::int64_t most = join_output(j, q.jobs, q.level->rank);
    q.outputs[j] = own ? std::max<std::int64_t>(0, most - 1) : most;
    sum = add(sum, multiply(q.outputs[j], topology_.join_work(j)));
    return q.outputs[j];
  };
  for (const Member& m : q.level->members) {
    std::int64_t& jobs = q.jobs[m.id];
    if (m.period > 0) {
      std::int64_t released = m.id == q.root && !q.later_root_jobs ? 0 : arrivals(m.period, t, q.closed);
      if (m.id == q.root) released = std::max(released, q.root_jobs);
      if (q.deadline) released = std::min(released, urgent_jobs(topology_.set()[m.id], *q.deadline));
      jobs = add(jobs, released);
    }
    for (const TaskId p : m.publishers) jobs = add(jobs, q.jobs[p] - (p == q.target ? 1 : 0));
    for (const std::size_t j : m.joins) jobs = add(jobs, output_of(j));
    sum = add(sum, multiply(jobs - (m.id == q.target ? 1 : 0), m.work));
  }
  for (const std::size_t j : q.level->joins) output_of(j);
  return sum;
}

/// Least t >= `from` at which all work released before is done; none if that takes for ever.
std::optional<std::int64_t> GraphBusyWindow::end_of_work(Query& q, std::int64_t from) const {
  std::uint64_t steps = 0;
  const auto next = [&](std::int64_t t) { return ++steps > kMaxSteps ? kEndless : std::max(t, work(q, t)); };
  return exact::least_fixed_point(from, next, kEndless - 1);
}

/// The latest start of the target's job. `starts`: the latest ones found with other blockers, job by job;
/// where this one's is no later, theirs is returned.
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
  return waits ? overheads_.job : job_work(q.target);
}

/// From a timestamp `released` behind the window's start to the end of the target's job that starts there.
std::int64_t GraphBusyWindow::response_to(const Query& q, std::int64_t start, std::int64_t released) const {
  // Releases interrupt the job itself as well.
  const std::int64_t work = add(subtract(start, releases_work(start)), own_work(q));
  const std::int64_t finish = *exact::least_fixed_point(
      add(start, own_work(q)), [&](std::int64_t t) { return add(work, releases_work(t)); });
  return add(subtract(finish, released), overheads_.lateness);
}

/// The longest job that may have started with a later deadline than one `deadline` behind the window's start.
std::int64_t GraphBusyWindow::blocking_behind(std::int64_t deadline) const {
  std::int64_t longest = overheads_.wake_up;
  for (TaskId id = 0; id < topology_.size(); ++id) {
    const auto later = [&](TaskId timer) { return topology_.set()[timer].deadline.count() > deadline; };
    if (std::ranges::any_of(topology_.roots(id), later)) longest = std::max(longest, job_work(id));
  }
  return longest;
}

/// Timestamps of `root` behind the window's start at which its deadline is that of another timer's job; few
/// of them, each standing for those up to the next.
std::vector<std::int64_t> GraphBusyWindow::deadline_steps(TaskId root, std::int64_t until) const {
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
  std::vector<std::int64_t> few;
  const std::size_t stride = ceil_div(static_cast<std::int64_t>(all.size()), kMaxDeadlineSteps);
  for (std::size_t i = 0; i < all.size(); i += stride) few.push_back(all[i]);
  return few;
}

/// As Spuri 1996 for timers: only jobs whose deadlines are not later than that of the path precede it.
std::optional<std::int64_t> GraphBusyWindow::bound_by_deadline(TaskId root, TaskId to, bool works,
                                                               PathParts* parts) const {
  const Level& in = level(order_.rank[root]);
  if (largest_rank(root, to) == kNoRank || !in.window) return std::nullopt;
  const Task& task = topology_.set()[root];
  Query q;
  q.level = &in;
  q.root = root;
  q.target = to;
  q.works = works;
  // A window behind the longest job is no longer than one with that job in it twice.
  q.blocker.work = blocking_behind(-overheads_.lateness - 1);
  Query whole = q;
  whole.target = kNoTask;
  whole.root = kNoTask;
  const auto until = end_of_work(whole, 0);
  if (!until) return std::nullopt;
  const std::vector<std::int64_t> steps = deadline_steps(root, *until);
  std::int64_t largest = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::int64_t last = i + 1 < steps.size() ? steps[i + 1] - 1 : *until;
    q.deadline = add(last, task.deadline.count());
    q.later_root_jobs = false;
    q.root_jobs = last / task.period.count() + 1;
    q.blocker.work = blocking_behind(add(steps[i], task.deadline.count()) - overheads_.lateness);
    q.closed = q.blocker.work == 0 || !order_.releases_first;
    const std::int64_t known = largest - overheads_.lateness + steps[i] - own_work(q);
    if (known >= 0 && overheads_.release == 0 && work(q, known) <= known) continue;
    const auto start = end_of_work(q, 0);
    if (!start) return std::nullopt;
    const std::int64_t response = response_to(q, *start, steps[i]);
    if (response <= largest) continue;
    largest = response;
    work(q, *start);
    if (parts != nullptr) *parts = parts_of(q);
  }
  return largest;
}

/// Largest time from a timestamp of query.root to the target's end, over all its jobs in the window.
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
    const std::int64_t response = response_to(q, w, released);
    if (parts != nullptr && response > largest) {
      work(q, w);
      *parts = parts_of(q);
    }
    largest = std::max(largest, response);
    // The next job is in the same window if it is released before all the rest is done.
    const std::int64_t next = add(released, period) - overheads_.lateness;
    if (*q.level->window <= next) return largest;
    Query rest = q;
    rest.target = kNoTask;
    rest.later_root_jobs = false;
    const auto end = end_of_work(rest, 0);
    if (!end) return std::nullopt;
    if (*end <= next) return largest;
  }
  return std::nullopt;
}

/// Of the jobs that work() has counted last.
PathParts GraphBusyWindow::parts_of(const Query& q) const {
  PathParts parts;
  parts.blocking = q.blocker.work;
  parts.blocker = q.blocker.longest;
  for (const Member& m : q.level->members) {
    std::int64_t sum = multiply(q.jobs[m.id], m.work);
    if (const auto* join = topology_.join_of(m.id); join && join->inputs.front() == m.id) {
      const bool own = topology_.join_index(q.target) == topology_.join_index(m.id);
      const std::int64_t outputs = q.outputs[topology_.join_index(m.id)] + (own ? 1 : 0);
      sum = add(sum, multiply(outputs, topology_.join_work(topology_.join_index(m.id))));
    }
    if (sum > 0) parts.work.emplace_back(m.id, sum);
  }
  std::ranges::stable_sort(parts.work, std::greater<>(), [](const auto& part) { return part.second; });
  return parts;
}

PathParts GraphBusyWindow::parts(TaskId root, TaskId to) const {
  PathParts parts;
  static_cast<void>(find_bound(root, to, true, &parts));
  return parts;
}

std::optional<std::int64_t> GraphBusyWindow::bound(TaskId root, TaskId to, bool works) const {
  const auto [entry, is_new] = known_.try_emplace({root, to, works});
  if (is_new) entry->second = find_bound(root, to, works, nullptr);
  return entry->second;
}

std::optional<std::int64_t> GraphBusyWindow::find_bound(TaskId root, TaskId to, bool works,
                                                        PathParts* parts) const {
  if (order_.by_deadline) return bound_by_deadline(root, to, works, parts);
  const std::int64_t rank = largest_rank(root, to);
  if (rank == kNoRank) return std::nullopt;
  const Level& in = level(rank);
  if (!in.window) return std::nullopt;
  std::int64_t largest = 0;
  std::vector<std::int64_t> starts;
  for (const Blocker& blocker : in.blockers) {
    Query q;
    q.level = &in;
    q.blocker = blocker;
    q.root = root;
    q.target = to;
    q.works = works;
    q.later_root_jobs = !(order_.timers_behind_equals && order_.rank[root] == rank);
    q.closed = blocker.work == 0 || !order_.releases_first;
    PathParts of_blocker;
    const auto found = bound(q, starts, parts ? &of_blocker : nullptr);
    if (!found) return std::nullopt;
    if (parts != nullptr && *found > largest) *parts = of_blocker;
    largest = std::max(largest, *found);
  }
  return largest;
}

}  // namespace hotpath
