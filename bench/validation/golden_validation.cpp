// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "hotpath/core/golden_trace.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "validation/validation.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// Where the golden trace of a task set under an executor is, if there is one.
fs::path golden_trace_file(const fs::path& reference, const std::string& set, const ExecutorEntry& executor) {
  return reference / "traces" / (set + "." + std::string(executor.name) + ".csv");
}

/// What the real stack did.
Schedule golden_schedule(const fs::path& file, const ExecutorEntry& executor) {
  return schedule_of(read_golden_trace(file), executor.traits.timers == TimerHandling::release_only);
}

std::string golden_verdict(const ScheduleComparison& bare, const ScheduleComparison& costs,
                           const Platform& p) {
  if (bare.similarity == 1) return "the same order, job by job";
  if (bare.similarity_by_period == 1) {
    return "the same but for the order among equal periods, which the fork leaves to its heap";
  }
  const std::string charged =
      text("%.0f us of dispatch, %.0f us for each wait and %.0f us of wake-up", to_us(p.dispatch_cost),
           to_us(p.wait_cost + p.other_entities * p.wait_cost_per_entity), to_us(p.wake_up_latency));
  if (agrees(costs)) {
    return agrees(bare) ? "the same but for places where a release and the end of a job almost coincide"
                        : "costs decide: timers fall due about when a window closes, and " + charged +
                              " put them on the side where the real stack has them";
  }
  return text("similarity %.3f even with ", costs.similarity) + charged +
         ": costs here vary from job to job, and one timer more or less in a window shifts all that follows";
}

GoldenValidation validate(const std::string& set, const ExecutorEntry& executor, const fs::path& file) {
  const Schedule real = golden_schedule(file, executor);
  if (real.jobs.empty()) throw UsageError("the golden trace " + file.string() + " has no jobs");
  const Duration length = real.jobs.back().start - Time{} + Duration(1);
  const Platform costs = reference_platform(executor, real.set.size());
  const ScheduleComparison without = compare_schedules(real, predict_timers(real.set, executor, {}, length));
  const ScheduleComparison with = compare_schedules(real, predict_timers(real.set, executor, costs, length));
  return {set,
          std::string(executor.name),
          {{"dispatch", to_us(costs.dispatch_cost)},
           {"wait", to_us(costs.wait_cost)},
           {"wait_per_entity", to_us(costs.wait_cost_per_entity)},
           {"wake_up", to_us(costs.wake_up_latency)}},
          without,
          with,
          golden_verdict(without, with, costs)};
}

std::set<std::string> recorded_sets(const fs::path& traces) {
  std::set<std::string> sets;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(traces, error)) {
    if (file.path().extension() == ".csv") sets.insert(file.path().stem().stem());
  }
  if (sets.empty()) {
    throw UsageError("the golden traces " + traces.string() +
                     "/SET.EXECUTOR.csv cannot be read; name another folder with --reference");
  }
  return sets;
}

/// First releases that differ by more than this are not the same phases.
constexpr double kSamePhases_ms = 0.1;

bool same_timers(const TaskSet& a, const TaskSet& b) {
  return std::ranges::equal(a.tasks, b.tasks, [](const Task& x, const Task& y) {
    return x.name == y.name && x.period == y.period;
  });
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
std::string run_verdict(const RunAgainstGolden& g, const fs::path& file) {
  const ScheduleComparison& c = g.comparison;
  const std::string order =
      text("order %.3f alike, lost jobs within %.1f points", c.similarity, c.largest_loss_difference_percent);
  if (g.phases_differ_ms > kSamePhases_ms) {
    return order + text(
                       "; the phases differ by up to %.1f ms, and they decide the order: give the run "
                       "`--phases-file %s`",
                       g.phases_differ_ms, file.filename().c_str());
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

std::vector<GoldenValidation> validate_golden_traces(const fs::path& reference) {
  std::vector<GoldenValidation> all;
  for (const std::string& set : recorded_sets(reference / "traces")) {
    for (const ExecutorEntry& executor : executors()) {
      const fs::path file = golden_trace_file(reference, set, executor);
      if (fs::exists(file)) all.push_back(validate(set, executor, file));
    }
  }
  return all;
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
  g.verdict = run_verdict(g, file);
  return g;
}

}  // namespace hotpath
