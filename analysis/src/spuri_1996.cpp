// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/spuri_1996.hpp"

#include <algorithm>

#include "busy_window.hpp"

namespace hotpath {

namespace {

/// Start of the job of task i released at `a`, in the worst deadline busy period that begins at 0.
std::int64_t latest_start(const PeriodicTasks& tasks, std::size_t i, std::int64_t a, TimeModel model) {
  using exact::add, exact::multiply;
  const std::int64_t d = add(a, tasks[i].deadline);
  std::int64_t longest_later = 0;
  for (const PeriodicTask& t : tasks) {
    if (t.deadline > d) longest_later = std::max(longest_later, t.wcet);
  }
  const std::int64_t blocked = blocking(longest_later, model);
  const bool closed = ties_interfere(blocked, model);
  const std::int64_t own = multiply(exact::floor_div(a, tasks[i].period), tasks[i].wcet);
  const auto others = [&](std::int64_t s) {
    std::int64_t sum = add(blocked, own);
    for (std::size_t j = 0; j < tasks.size(); ++j) {
      const PeriodicTask& t = tasks[j];
      if (j == i || t.deadline > d) continue;
      const std::int64_t released =
          closed ? exact::floor_div(s, t.period) + 1 : std::max<std::int64_t>(1, exact::ceil_div(s, t.period));
      const std::int64_t urgent = exact::floor_div(d - t.deadline, t.period) + 1;
      sum = add(sum, multiply(std::min(released, urgent), t.wcet));
    }
    return sum;
  };
  return *exact::least_fixed_point(others(0), others);
}

}  // namespace

ResponseTimes spuri_1996(const PeriodicTasks& tasks, TimeModel model) {
  check_tasks(tasks, {.method = "the NP-EDF response time analysis (spuri_1996)",
                      .instead = "nasri_2017 (schedule-abstraction graph)",
                      .jitter = false,
                      .overload = false});
  Interference all;
  std::int64_t latest_deadline = 0;
  for (const PeriodicTask& t : tasks) {
    all.add(t.wcet, t.period, 0);
    latest_deadline = std::max(latest_deadline, t.deadline);
  }
  const std::int64_t busy =
      *exact::least_fixed_point(all.once(), [&](std::int64_t t) { return all.before(t); });

  ResponseTimes bounds;
  std::vector<std::int64_t> releases;
  std::uint64_t steps = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    // Without a blocking job a busy period ends by `busy`; with one the job's deadline is before latest_deadline.
    const std::int64_t end = std::max(busy, latest_deadline - tasks[i].deadline);
    releases.assign(1, 0);
    for (const PeriodicTask& t : tasks) {
      const std::int64_t first = exact::subtract(t.deadline, tasks[i].deadline);
      const std::int64_t skip = first < 0 ? exact::ceil_div(-first, t.period) : 0;
      for (std::int64_t a = exact::add(first, exact::multiply(skip, t.period)); a < end;
           a = exact::add(a, t.period)) {
        if (++steps == exact::kMaxSteps) exact::report_slow_convergence();
        releases.push_back(a);
      }
    }
    std::sort(releases.begin(), releases.end());
    releases.erase(std::unique(releases.begin(), releases.end()), releases.end());
    std::int64_t response = 0;
    for (const std::int64_t a : releases) {
      response = std::max(response, exact::add(latest_start(tasks, i, a, model), tasks[i].wcet) - a);
    }
    bounds.push_back(std::max(response, tasks[i].wcet));
  }
  return bounds;
}

}  // namespace hotpath
