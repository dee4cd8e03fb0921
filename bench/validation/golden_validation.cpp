// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/input_error.hpp"
#include "hotpath/core/input_file.hpp"
#include "program/errors.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

namespace {

namespace fs = std::filesystem;

/// Path of the golden trace of a task set under an executor; the file may be missing.
fs::path golden_trace_file(const fs::path& reference, const std::string& set, const ExecutorEntry& executor) {
  return reference / "traces" / (set + "." + std::string(executor.name) + ".csv");
}

/// The schedule of the real stack.
results::Schedule golden_schedule(const fs::path& file, const ExecutorEntry& executor) {
  return results::schedule_of(read_golden_trace(file), executor.traits.timers == TimerHandling::release_only);
}

GoldenValidation validate(const std::string& set, const ExecutorEntry& executor, const fs::path& file) {
  const results::Schedule real = golden_schedule(file, executor);
  if (real.jobs.empty()) throw program::UsageError("the golden trace " + file.string() + " has no jobs");
  const Duration length = real.jobs.back().start - Time{} + Duration(1);
  const Platform costs = reference_platform(executor, real.set.size());
  return {set,
          std::string(executor.name),
          {{"dispatch", to_us(costs.longest_dispatch_cost())},
           {"wait", to_us(costs.wait_cost + costs.other_entities * costs.wait_cost_per_entity)},
           {"wake_up", to_us(costs.wake_up_latency)}},
          compare_schedules(real, predict_timers(real.set, executor, {}, length)),
          compare_schedules(real, predict_timers(real.set, executor, costs, length))};
}

std::set<std::string> recorded_sets(const fs::path& traces) {
  std::set<std::string> sets;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(traces, error)) {
    if (file.path().extension() == ".csv") sets.insert(file.path().stem().stem());
  }
  const std::string remedy = "name the folder of the reference measurements";
  if (error) refuse_input(traces.string(), error.message(), remedy);
  if (sets.empty()) throw InputError(traces.string(), 0, "has no file SET.EXECUTOR.csv", remedy);
  return sets;
}

bool same_timers(const TaskSet& a, const TaskSet& b) {
  return std::ranges::equal(a.tasks, b.tasks, [](const Task& x, const Task& y) {
    return x.name == y.name && x.period == y.period;
  });
}

/// Time in which jobs ran, in percent of the time until the last finish.
double busy_percent(const results::Schedule& schedule) {
  Duration busy{};
  Time end{};
  for (const results::ExecutedJob& job : schedule.jobs) {
    if (!job.finished()) continue;
    busy += job.finish - job.start;
    end = std::max(end, job.finish);
  }
  return end > Time{} ? 100 * to_ms(busy) / to_ms(end - Time{}) : 0;
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
                                               const results::Schedule& run, const ExecutorEntry& executor) {
  RunAgainstGolden g;
  g.set = graph.substr(0, graph.find("_authors"));
  const fs::path file = golden_trace_file(reference, g.set, executor);
  if (!fs::exists(file)) return std::nullopt;
  const results::Schedule real = golden_schedule(file, executor);
  if (!same_timers(real.set, run.set)) return std::nullopt;
  std::vector<Duration> first;
  for (const Task& task : run.set.tasks) first.push_back(task.phase);
  g.phases_differ_ms = largest_phase_difference_ms(real.set, first);
  g.real_busy_percent = busy_percent(real);
  g.run_busy_percent = busy_percent(run);
  g.comparison = compare_schedules(real, run);
  g.phases_file = file.filename();
  return g;
}

}  // namespace hotpath::validation
