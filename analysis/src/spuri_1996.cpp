// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/spuri_1996.hpp"

#include <algorithm>

#include "busy_window.hpp"

namespace hotpath {

namespace {

using exact::add, exact::ceil_div, exact::floor_div, exact::multiply, exact::subtract;

/// Tasks of equal period and deadline; they differ only in their execution times.
struct Group {
  std::int64_t period, deadline, wcet, longest;
};

std::vector<Group> group(const PeriodicTasks& tasks) {
  std::vector<Group> groups;
  for (const PeriodicTask& t : tasks) {
    const auto existing = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
      return g.period == t.period && g.deadline == t.deadline;
    });
    if (existing == groups.end()) {
      groups.push_back({t.period, t.deadline, t.wcet, t.wcet});
    } else {
      existing->wcet = add(existing->wcet, t.wcet);
      existing->longest = std::max(existing->longest, t.wcet);
    }
  }
  return groups;
}

/// Start of the job of `task` released at `a`, in the worst deadline busy period beginning at 0.
std::int64_t latest_start(const std::vector<Group>& groups, const PeriodicTask& task, std::int64_t a,
                          TimeModel model) {
  const std::int64_t d = add(a, task.deadline);
  std::int64_t longest_later = 0;
  for (const Group& g : groups) {
    if (g.deadline > d) longest_later = std::max(longest_later, g.longest);
  }
  const std::int64_t blocked = blocking(longest_later, model);
  const bool closed = ties_interfere(blocked, model);
  const std::int64_t fixed = add(blocked, multiply(floor_div(a, task.period), task.wcet));
  const auto work = [&](std::int64_t s) {
    std::int64_t sum = fixed;
    for (const Group& g : groups) {
      if (g.deadline > d) continue;
      const bool own = g.period == task.period && g.deadline == task.deadline;
      const std::int64_t released =
          closed ? floor_div(s, g.period) + 1 : std::max<std::int64_t>(1, ceil_div(s, g.period));
      const std::int64_t urgent = floor_div(d - g.deadline, g.period) + 1;
      sum = add(sum, multiply(std::min(released, urgent), own ? g.wcet - task.wcet : g.wcet));
    }
    return sum;
  };
  return *exact::least_fixed_point(work(0), work);
}

/// Releases at which the response time can be largest: they give the job the same deadline as
/// another job released in step with the start of the busy period.
std::vector<std::int64_t> candidates(const std::vector<Group>& groups, const PeriodicTask& task,
                                     std::int64_t end) {
  std::vector<std::int64_t> releases = {0};
  for (const Group& g : groups) {
    const std::int64_t first = subtract(g.deadline, task.deadline);
    const std::int64_t skip = first < 0 ? ceil_div(-first, g.period) : 0;
    for (std::int64_t a = add(first, multiply(skip, g.period)); a < end; a = add(a, g.period)) {
      if (releases.size() == exact::kMaxSteps) exact::report_slow_convergence();
      releases.push_back(a);
    }
  }
  std::sort(releases.begin(), releases.end());
  releases.erase(std::unique(releases.begin(), releases.end()), releases.end());
  return releases;
}

}  // namespace

ResponseTimes spuri_1996(const PeriodicTasks& tasks, TimeModel model) {
  check_tasks(tasks, {.method = "the NP-EDF response time analysis (spuri_1996)",
                      .instead = "explore() (hotpath/core/exploration.hpp)",
                      .jitter = false,
                      .overload = false});
  const std::vector<Group> groups = group(tasks);
  Interference all;
  exact::Utilisation utilisation;
  std::int64_t latest_deadline = 0, longest = 0;
  for (const PeriodicTask& t : tasks) {
    all.add(t.wcet, t.period, 0);
    utilisation.add(t.wcet, t.period);
    latest_deadline = std::max(latest_deadline, t.deadline);
    longest = std::max(longest, t.wcet);
  }
  // After a blocking job a busy period lasts at most `blocked_busy`, which is finite below full
  // utilisation. Without a blocking job it ends by `busy`; with one, the job's deadline is before
  // the latest relative deadline.
  std::int64_t blocked_busy = std::numeric_limits<std::int64_t>::max(), busy = blocked_busy;
  if (utilisation.compare_to_one() < 0) {
    blocked_busy = *exact::least_fixed_point(add(longest, all.once()),
                                             [&](std::int64_t t) { return add(longest, all.before(t)); });
  } else {
    busy = *exact::least_fixed_point(all.once(), [&](std::int64_t t) { return all.before(t); });
  }

  ResponseTimes bounds;
  bounds.reserve(tasks.size());
  for (const PeriodicTask& task : tasks) {
    const std::int64_t end = std::min(blocked_busy, std::max(busy, latest_deadline - task.deadline));
    std::int64_t response = task.wcet;
    for (const std::int64_t a : candidates(groups, task, end)) {
      response = std::max(response, add(latest_start(groups, task, a, model), task.wcet) - a);
    }
    bounds.push_back(response);
  }
  return bounds;
}

}  // namespace hotpath
