// SPDX-License-Identifier: Apache-2.0
#include "validation/run_against_golden.hpp"

#include <algorithm>
#include <cmath>

#include "program/text.hpp"
#include "validation/golden_validation.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// First releases that differ by more than this are not the same phases.
constexpr double kSamePhases_ms = 0.1;

bool same_timers(const TaskSet& a, const TaskSet& b) {
  return std::equal(a.tasks.begin(), a.tasks.end(), b.tasks.begin(), b.tasks.end(),
                    [](const Task& x, const Task& y) { return x.name == y.name && x.period == y.period; });
}

/// Share of the time until the last finish in which jobs ran.
double busy_percent(const Schedule& schedule) {
  Duration busy{};
  Time end{};
  for (const ExecutedJob& job : schedule.jobs) {
    if (!job.finished()) continue;
    busy += job.finish - job.start;
    end = std::max(end, job.finish);
  }
  return end > Time{} ? 100 * to_ms(busy) / to_ms(end - Time{}) : 0;
}

/// How well a run meets the real stack, and why not better.
std::string golden_verdict(const RunAgainstGolden& g, const fs::path& file) {
  const ScheduleComparison& c = g.comparison;
  const std::string order =
      text("order %.3f alike, lost jobs within %.1f points", c.similarity, c.largest_loss_difference());
  if (g.phases_differ_ms > kSamePhases_ms) {
    return order +
           text("; the phases differ by up to %.1f ms, and they decide the order: give the run ",
                g.phases_differ_ms) +
           "`--phases-file " + file.filename().string() + "`";
  }
  if (agrees(c)) return order;
  if (c.similarity_by_period == 1) return order + "; the same but for the order among equal periods";
  return order +
         text(
             "; jobs ran %.1f %% of the time there and %.1f %% here: execution times, costs and noise of "
             "this machine put timers into another window, and all that follows shifts",
             g.real_busy_percent, g.run_busy_percent);
}

}  // namespace

double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first) {
  double largest = 0;
  for (TaskId id = 0; id < set.size(); ++id) {
    largest = std::max(largest, std::abs(to_ms(set[id].phase - first[id])));
  }
  return largest;
}

std::optional<RunAgainstGolden> against_golden(const fs::path& reference, const std::string& graph,
                                               const Schedule& run, const ExecutorEntry& executor) {
  RunAgainstGolden g;
  g.set = graph.substr(0, graph.find("_authors"));
  const fs::path file = golden_trace_file(reference, g.set, executor);
  if (!fs::exists(file)) return std::nullopt;
  const Schedule real = golden_schedule(file, executor);
  if (!same_timers(real.set, run.set)) return std::nullopt;
  std::vector<Duration> first;
  for (const Task& task : run.set.tasks) first.push_back(task.phase);
  g.phases_differ_ms = largest_phase_difference_ms(real.set, first);
  g.real_busy_percent = busy_percent(real);
  g.run_busy_percent = busy_percent(run);
  g.comparison = compare_schedules(real, run);
  g.verdict = golden_verdict(g, file);
  return g;
}

}  // namespace hotpath
