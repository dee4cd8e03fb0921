// SPDX-License-Identifier: Apache-2.0
#include "george_1996.hpp"

#include <algorithm>
#include <queue>
#include <utility>

#include "busy_window.hpp"

namespace hotpath {

namespace {

/// The jobs that can block at an instant: jobs of tasks with a relative deadline after it.
class BlockingJobs {
 public:
  explicit BlockingJobs(PeriodicTasks tasks) : by_deadline_(std::move(tasks)) {
    std::sort(by_deadline_.begin(), by_deadline_.end(),
              [](const PeriodicTask& a, const PeriodicTask& b) { return a.deadline < b.deadline; });
    longest_from_.resize(by_deadline_.size() + 1, 0);
    for (std::size_t i = by_deadline_.size(); i-- > 0;) {
      longest_from_[i] = std::max(longest_from_[i + 1], by_deadline_[i].wcet);
    }
  }

  /// The execution time of the longest at `t`; `t` must not decrease between calls.
  std::int64_t longest(std::int64_t t) {
    while (passed_ < by_deadline_.size() && by_deadline_[passed_].deadline <= t) ++passed_;
    return longest_from_[passed_];
  }

 private:
  PeriodicTasks by_deadline_;
  std::vector<std::int64_t> longest_from_;
  std::size_t passed_ = 0;  // tasks in by_deadline_ with D <= t
};

}  // namespace

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

  // A violation at or after the end of the busy period without blocking implies an earlier one, by
  // the length of that period. From D_max on there is no blocking, and with D >= T demand never
  // exceeds U * t.
  std::int64_t end = long_deadlines ? latest_deadline : std::numeric_limits<std::int64_t>::max();
  if (const auto busy = exact::least_fixed_point(
          all.once(), [&](std::int64_t t) { return all.before(t); }, end)) {
    end = *busy;
  }

  using Point = std::pair<std::int64_t, std::size_t>;  // absolute deadline, task
  std::priority_queue<Point, std::vector<Point>, std::greater<>> points;
  for (std::size_t i = 0; i < tasks.size(); ++i) points.push({tasks[i].deadline, i});

  DemandTest result{true, std::numeric_limits<std::int64_t>::max(), 0};
  std::int64_t demand = 0;
  BlockingJobs blocking_jobs(tasks);
  // The earliest deadline is always tested, so that there is a slack to report.
  for (std::uint64_t step = 0; step == 0 || points.top().first < end; ++step) {
    if (step == exact::kMaxSteps) exact::report_slow_convergence();
    const std::int64_t t = points.top().first;
    while (points.top().first == t) {
      const std::size_t i = points.top().second;
      points.pop();
      demand = exact::add(demand, tasks[i].wcet);
      points.push({exact::add(t, tasks[i].period), i});
    }
    const std::int64_t slack = t - exact::add(demand, blocking(blocking_jobs.longest(t), model));
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
