// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/release_overhead.hpp"

#include <algorithm>

#include "interference.hpp"

namespace hotpath {

namespace {

constexpr MethodScope kOverheadScope = {.method = "the release overhead (Section V-B)", .instead = ""};

void check_delta(std::int64_t delta) {
  if (delta < 0) {
    throw AnalysisError("release cost delta of " + std::to_string(delta) + " ns is negative; give 0 or more");
  }
}

void inflate(PeriodicTask& task, std::int64_t overhead) { task.wcet = exact::add(task.wcet, overhead); }

/// Conditions C1 and C2 of Section V-A hold if no job spans two timestamps of another task.
void check_no_skips(const PeriodicTasks& tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    for (std::size_t j = 0; j < tasks.size(); ++j) {
      if (i == j || tasks[i].wcet < tasks[j].period) continue;
      throw AnalysisError(
          task_label(tasks, i) + ": execution time with overhead, " + std::to_string(tasks[i].wcet) +
          " ns, reaches the period " + std::to_string(tasks[j].period) + " ns of " + task_label(tasks, j) +
          ", so that release-and-execute may skip its timestamps (condition C1 of Section V-A); "
          "release-only does not");
    }
  }
}

}  // namespace

std::optional<ReleaseOverhead> release_overhead_ro(const PeriodicTasks& tasks, std::size_t position,
                                                   std::int64_t delta) {
  check_delta(delta);
  check_tasks(tasks, kOverheadScope);
  exact::Utilisation releases;
  Interference cost;
  for (const PeriodicTask& t : tasks) {
    releases.add(delta, t.period);
    cost.add(delta, t.period, 0);
  }
  if (releases.compare_to_one() >= 0) return std::nullopt;
  const std::int64_t wcet = tasks[position].wcet;
  const std::int64_t t0 = *exact::least_fixed_point(
      exact::add(wcet, cost.once()), [&](std::int64_t t) { return exact::add(wcet, cost.before(t)); });
  return ReleaseOverhead{t0, t0 - wcet};
}

OverheadAwareResponse with_release_overhead(const PeriodicTasks& tasks, std::int64_t delta, ReleaseMode mode,
                                            const ResponseTimeAnalysis& analysis) {
  check_delta(delta);
  check_tasks(tasks, kOverheadScope);
  const std::int64_t once_each = exact::multiply(static_cast<std::int64_t>(tasks.size()), delta);
  OverheadAwareResponse tight{tasks, {}, false};
  for (PeriodicTask& t : tight.tasks) inflate(t, once_each);
  if (mode == ReleaseMode::release_and_execute) {
    check_no_skips(tight.tasks);
    tight.bounds = analysis(tight.tasks);
    return tight;
  }

  OverheadAwareResponse result{tasks, {}, false};
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const auto overhead = release_overhead_ro(tasks, i, delta);
    if (!overhead) {
      throw AnalysisError(
          "releasing jobs at a cost of " + std::to_string(delta) +
          " ns each uses the whole processor, so that the overhead of Equation (3) diverges; lower "
          "the cost or the rates");
    }
    inflate(result.tasks[i], overhead->overhead);
  }
  result.bounds = analysis(result.tasks);
  const bool constrained =
      std::all_of(tasks.begin(), tasks.end(), [](const PeriodicTask& t) { return t.deadline <= t.period; });
  if (!constrained || !schedulable(result.tasks, result.bounds)) return result;
  tight.bounds = analysis(tight.tasks);
  tight.tightened = true;
  return tight;
}

}  // namespace hotpath
