// SPDX-License-Identifier: Apache-2.0
#include "sag_job.hpp"

#include <algorithm>
#include <ostream>

#include "hotpath/analysis/exact.hpp"
#include "interference.hpp"
#include "task_sets.hpp"

namespace hotpath {

namespace {

/// The largest age of unfinished jobs at a release: the longest busy window plus the largest
/// jitter. 0 without jitter, because then everything repeats with the hyperperiod.
std::int64_t busy_window_with_jitter(const PeriodicTasks& tasks) {
  Interference all;
  exact::Utilisation utilisation;
  std::int64_t largest = 0;
  for (const PeriodicTask& t : tasks) {
    all.add(t.wcet, t.period, t.jitter);
    utilisation.add(t.wcet, t.period);
    largest = std::max(largest, t.jitter);
  }
  if (largest == 0) return 0;
  if (utilisation.compare_to_one() == 0) {
    throw AnalysisError(
        "with a utilisation of 1 and release jitter no number of hyperperiods suffices; lower the "
        "utilisation or remove the jitter");
  }
  return exact::add(largest,
                    *exact::least_fixed_point(all.once(), [&](std::int64_t t) { return all.before(t); }));
}

}  // namespace

std::vector<SagJob> sag_jobs(const PeriodicTasks& tasks, SagPolicy policy) {
  using exact::add;
  constexpr std::string_view kMethod = "the schedule-abstraction graph (nasri_2017)";
  constexpr std::string_view kInstead = "davis_2007 (exact NP-FP) or spuri_1996 (NP-EDF)";
  check_tasks(tasks, {.method = kMethod, .instead = kInstead, .overload = false});
  const std::int64_t h = hyperperiod(tasks);
  std::int64_t horizon = h, latest_phase = 0;
  for (const PeriodicTask& t : tasks) latest_phase = std::max(latest_phase, t.phase);
  if (latest_phase > 0) horizon = add(latest_phase, exact::multiply(2, h));
  if (const std::int64_t reach = busy_window_with_jitter(tasks); reach > 0) {
    horizon = add(horizon, exact::multiply(exact::ceil_div(reach, h), h));
  }

  std::int64_t count = 0;
  for (const PeriodicTask& t : tasks) count = add(count, exact::ceil_div(horizon - t.phase, t.period));
  if (count > kMaxSagJobs) {
    throw AnalysisError(
        "a hyperperiod of " + std::to_string(h) + " ns gives " + std::to_string(count) +
        " jobs, more than the " + std::to_string(kMaxSagJobs) + " that " + std::string(kMethod) +
        " takes; choose periods with a smaller common multiple, or use " + std::string(kInstead));
  }
  std::vector<SagJob> jobs;
  jobs.reserve(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const PeriodicTask& t = tasks[i];
    std::uint64_t number = 0;
    for (std::int64_t r = t.phase; r < horizon; r = add(r, t.period)) {
      const std::int64_t deadline = add(r, t.deadline);
      jobs.push_back({.task = i,
                      .job = number++,
                      .arrival_min = r,
                      .arrival_max = add(r, t.jitter),
                      .cost_min = t.bcet,
                      .cost_max = t.wcet,
                      .deadline = deadline,
                      .priority = policy == SagPolicy::edf ? deadline : static_cast<std::int64_t>(i)});
    }
  }
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const SagJob& a, const SagJob& b) { return a.arrival_min < b.arrival_min; });
  return jobs;
}

void write_sag_csv(std::ostream& out, const std::vector<SagJob>& jobs) {
  out << "Task ID, Job ID, Arrival min, Arrival max, Cost min, Cost max, Deadline, Priority\n";
  for (const SagJob& j : jobs) {
    out << j.task << ", " << j.job << ", " << j.arrival_min << ", " << j.arrival_max << ", " << j.cost_min
        << ", " << j.cost_max << ", " << j.deadline << ", " << j.priority << '\n';
  }
}

}  // namespace hotpath
