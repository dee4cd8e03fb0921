// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/george_1996.hpp"

#include <algorithm>
#include <queue>

#include "busy_window.hpp"

namespace hotpath {

DemandTest george_1996(const PeriodicTasks& tasks, TimeModel model) {
  check_tasks(tasks, {.method = "the NP-EDF demand test (george_1996)",
                      .instead = "nasri_2017 (schedule-abstraction graph)",
                      .jitter = false});
  Interference all;
  exact::Utilisation utilisation;
  bool long_deadlines = true;
  std::int64_t latest_deadline = 0;
  for (const PeriodicTask& t : tasks) {
    all.add(t.wcet, t.period, 0);
    utilisation.add(t.wcet, t.period);
    long_deadlines = long_deadlines && t.deadline >= t.period;
    latest_deadline = std::max(latest_deadline, t.deadline);
  }
  if (utilisation.compare_to_one() > 0) return {};

  // A violation at or behind the end of the busy period without blocking implies one that much earlier. From
  // D_max on there is no blocking, and with D >= T demand never exceeds U * t.
  std::int64_t end = long_deadlines ? latest_deadline : std::numeric_limits<std::int64_t>::max();
  if (const auto busy = exact::least_fixed_point(
          all.once(), [&](std::int64_t t) { return all.before(t); }, end)) {
    end = *busy;
  }

  std::vector<std::size_t> by_deadline(tasks.size());
  for (std::size_t i = 0; i < tasks.size(); ++i) by_deadline[i] = i;
  std::sort(by_deadline.begin(), by_deadline.end(),
            [&](std::size_t a, std::size_t b) { return tasks[a].deadline < tasks[b].deadline; });
  std::vector<std::int64_t> longest_from(tasks.size() + 1, 0);
  for (std::size_t i = tasks.size(); i-- > 0;) {
    longest_from[i] = std::max(longest_from[i + 1], tasks[by_deadline[i]].wcet);
  }

  using Point = std::pair<std::int64_t, std::size_t>;  // absolute deadline, task
  std::priority_queue<Point, std::vector<Point>, std::greater<>> points;
  for (std::size_t i = 0; i < tasks.size(); ++i) points.push({tasks[i].deadline, i});

  DemandTest result{true, std::numeric_limits<std::int64_t>::max(), 0};
  std::int64_t demand = 0;
  std::size_t not_blocking = 0;  // tasks in by_deadline with D <= t
  // The earliest deadline is always a point, so that there is a slack to report.
  for (std::uint64_t step = 0; step == 0 || points.top().first < end; ++step) {
    if (step == exact::kMaxSteps) exact::report_slow_convergence();
    const std::int64_t t = points.top().first;
    while (points.top().first == t) {
      const std::size_t i = points.top().second;
      points.pop();
      demand = exact::add(demand, tasks[i].wcet);
      points.push({exact::add(t, tasks[i].period), i});
    }
    while (not_blocking < tasks.size() && tasks[by_deadline[not_blocking]].deadline <= t) ++not_blocking;
    const std::int64_t slack = t - exact::add(demand, blocking(longest_from[not_blocking], model));
    if (slack < result.slack) {
      result.slack = slack;
      result.t = t;
    }
    if (slack < 0) {
      result.schedulable = false;
      break;
    }
  }
  return result;
}

}  // namespace hotpath
