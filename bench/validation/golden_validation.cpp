// SPDX-License-Identifier: Apache-2.0
#include "validation/golden_validation.hpp"

#include <set>

#include "hotpath/core/golden_trace.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "validation/prediction.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

std::string golden_verdict(const ScheduleComparison& bare, const ScheduleComparison& costs,
                           const Platform& p) {
  if (bare.similarity == 1) return "the same order, job by job";
  if (bare.similarity_by_period == 1) {
    return "the same but for the order among equal periods, which the fork leaves to its heap";
  }
  const std::string charged =
      text("%.0f us of dispatch and %.0f us of wake-up", to_us(p.dispatch_cost), to_us(p.wake_up_latency));
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
  GoldenValidation v;
  v.set = set;
  v.executor = executor.name;
  v.costs = reference_platform(executor);
  v.without_costs = compare_schedules(real, predict_timers(real.set, executor, {}, length));
  v.with_costs = compare_schedules(real, predict_timers(real.set, executor, v.costs, length));
  v.verdict = golden_verdict(v.without_costs, v.with_costs, v.costs);
  return v;
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

fs::path golden_trace_file(const fs::path& reference, const std::string& set, const ExecutorEntry& executor) {
  return reference / "traces" / (set + "." + std::string(executor.name) + ".csv");
}

Schedule golden_schedule(const fs::path& file, const ExecutorEntry& executor) {
  return schedule_of(read_golden_trace(file), executor.traits.timers == TimerHandling::release_only);
}

}  // namespace hotpath
