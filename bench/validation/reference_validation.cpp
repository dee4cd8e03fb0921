// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "hotpath/core/csv.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Measures of one run; response times are means over tasks.
struct TimersOnlyRun {
  double imu_lost_percent = 0, response_p50_ms = 0, response_p99_ms = 0;
};

void widen(Range& range, double x) { range = {std::min(range.front(), x), std::max(range.back(), x)}; }

void add(TimersOnlyRanges& ranges, const TimersOnlyRun& run) {
  widen(ranges.imu_lost_percent, run.imu_lost_percent);
  widen(ranges.response_authors_p50_ms, run.response_p50_ms);
  widen(ranges.response_authors_p99_ms, run.response_p99_ms);
}

/// Whether the ranges overlap, or are at most `slack` apart.
bool meet(const Range& a, const Range& b, double slack) {
  return a.front() - slack <= b.back() && b.front() <= a.back() + slack;
}

TimersOnlyRun predict(const Graph& graph, const ExecutorEntry& executor, Duration step) {
  constexpr Duration kLength = 45s;
  GraphTasks tasks = make_tasks(graph);
  setup::set_phases(tasks.set, make_phases(graph, tasks, Phases::creation, {step, 1}));
  const results::Schedule s =
      predict_timers(tasks.set, executor, reference_platform(executor, tasks.set.size()), kLength);
  TimersOnlyRun run;
  for (TaskId id = 0; id < s.set.size(); ++id) {
    std::vector<double> responses;
    for (const results::ExecutedJob& job : s.jobs) {
      if (job.task == id && job.finished()) responses.push_back(to_ms(results::response_authors(s, job)));
    }
    if (s.set[id].name == "IMU") {
      const double timestamps = static_cast<double>(1 + (kLength - 1ns - s.set[id].phase) / s.set[id].period);
      run.imu_lost_percent = 100 * (1 - static_cast<double>(responses.size()) / timestamps);
    }
    std::ranges::sort(responses);
    run.response_p50_ms += quantile(responses, 0.5) / s.set.size();
    run.response_p99_ms += quantile(responses, 0.99) / s.set.size();
  }
  return run;
}

/// Utilisation of the set and name of the executor in the reference.
using Subject = std::pair<std::string, std::string>;

std::map<Subject, TimersOnlyRanges> read_measured(const fs::path& file) {
  std::map<Subject, std::map<std::string, std::pair<int, TimersOnlyRun>>> by_repetition;
  CsvReader row(file);
  static_cast<void>(row.column("utilisation_percent"));  // checks the header even without rows
  while (row.next()) {
    const Subject subject(row.text("utilisation_percent"), row.text("executor"));
    auto& [tasks, run] = by_repetition[subject][std::string(row.text("repetition"))];
    ++tasks;
    run.response_p50_ms += row.number<double>("response_p50_ms");
    run.response_p99_ms += row.number<double>("response_p99_ms");
    if (row.text("task") == "IMU") {
      run.imu_lost_percent = 100 * row.number<double>("dropped") / row.number<double>("released");
    }
  }
  std::map<Subject, TimersOnlyRanges> measured;
  for (const auto& [subject, repetitions] : by_repetition) {
    for (const auto& [repetition, sum] : repetitions) {
      const auto& [tasks, run] = sum;
      add(measured[subject],
          {run.imu_lost_percent, run.response_p50_ms / tasks, run.response_p99_ms / tasks});
    }
  }
  return measured;
}

/// The measured fork has release-only timers, but not in its executors' names.
const ExecutorEntry* executor_of_fork(const std::string& name) {
  const ExecutorEntry* const executor = find_executor(name);
  return executor != nullptr ? executor : find_executor(name + "-ro");
}

}  // namespace

std::vector<TimersOnlyValidation> validate_timers_only(const fs::path& reference) {
  std::vector<TimersOnlyValidation> all;
  for (const auto& [subject, measured] : read_measured(reference / "rclcpp_timers_only.csv")) {
    const ExecutorEntry* const executor = executor_of_fork(subject.second);
    if (executor == nullptr) continue;
    const Graph graph = load_graph(find_graph("timers_only_" + subject.first + "_authors"));
    TimersOnlyRanges simulated;
    for (const Duration step : {2500us, 3000us, 3500us, 4000us, 4500us, 5000us}) {
      add(simulated, predict(graph, *executor, step));
    }
    all.push_back({graph.name, std::string(executor->name), measured, simulated,
                   meet(measured.imu_lost_percent, simulated.imu_lost_percent, kSameLoss_percent)});
  }
  return all;
}

std::vector<AutowareValidation> validate_autoware(const std::filesystem::path& reference) {
  Graph graph = load_graph(find_graph("autoware"));
  for (Node& node : graph.nodes) {
    for (Callback& callback : node.callbacks)
      if (callback.worst > Duration{}) callback.worst = callback.best = 4220us;
  }
  const std::filesystem::path file = reference / "rclcpp_autoware_phases.csv";
  std::vector<AutowareValidation> all;
  CsvReader row(file);
  static_cast<void>(row.column("executor"));
  while (row.next()) {
    const std::string label(row.text("executor"));
    const std::string name = label.substr(0, label.find(' '));
    GraphTasks tasks = make_tasks(graph);
    setup::set_phases(tasks.set, read_phases(file, graph, name));
    // As in the fork's heap: subscriptions before timers, and the earlier of two equal jobs first.
    const setup::ExecutorSpec executor =
        setup::parse_executor(name, {SubscriptionRule::first, Ties::fifo, 2});
    SimulationOptions options;
    options.platform = reference_platform(*executor.entry, static_cast<std::uint32_t>(graph.nodes.size()));
    options.duration = 30s;
    const WorstCaseTimes times(tasks.set);
    // The six outputs of a hyperperiod (600 ms) differ: whole hyperperiods are counted.
    const SimulatedOutcome p = predict(graph, tasks, executor, times, options, 1200ms);
    AutowareValidation v{label, real_latencies(row), latency_quantiles(p.latencies_ms.at(0)), {}};
    v.median =
        compare_medians(v.measured_ms, v.simulated_ms, executor.entry->traits.many_workers ? 0.10 : 0.05);
    all.push_back(std::move(v));
  }
  return all;
}

}  // namespace hotpath::validation
