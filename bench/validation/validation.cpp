// SPDX-License-Identifier: Apache-2.0
#include "validation/validation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "setup/executor_spec.hpp"
#include "validation/schedule_comparison.hpp"
#include "validation/validation_parts.hpp"

namespace hotpath {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// The golden programs and the authors' nodes work until an instant of the clock.
Schedule simulate_timers(const TaskSet& set, const std::string& executor, Platform platform,
                         Duration duration) {
  platform.wall_clock_work = true;
  const WorstCaseTimes times(set);
  PublishingWorkload workload(times);
  SimulationOptions options;
  options.platform = platform;
  options.duration = duration;
  return schedule_of(set, simulate_trace(set, *find_executor(executor), {}, workload, options));
}

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

}  // namespace

json validate_golden_traces(const fs::path& reference) {
  json all = json::array();
  for (const char* set : {"timers_only_60", "timers_only_80", "timers_only_90"}) {
    for (const char* executor : {"default", "static", "events-ro", "events-re", "rm-ro", "edf-ro"}) {
      const bool release_only = find_executor(executor)->traits.timers == TimerHandling::release_only;
      const fs::path file = reference / "traces" / (std::string(set) + "." + executor + ".csv");
      const Schedule real = schedule_of(read_golden_trace(file), release_only);
      if (real.jobs.empty())
        throw UsageError("the golden trace of " + std::string(executor) + " has no jobs");
      const Duration length = real.jobs.back().start - Time{} + 1ns;
      const Platform costs = reference_platform(*find_executor(executor));
      const ScheduleComparison bare = compare(real, simulate_timers(real.set, executor, {}, length));
      const ScheduleComparison charged = compare(real, simulate_timers(real.set, executor, costs, length));
      all.push_back({{"set", set},
                     {"executor", executor},
                     {"dispatch_cost_us", to_us(costs.dispatch_cost)},
                     {"wake_up_us", to_us(costs.wake_up_latency)},
                     {"without_costs", comparison_json(bare, "measured", "simulated")},
                     {"with_costs", comparison_json(charged, "measured", "simulated")},
                     {"verdict", golden_verdict(bare, charged, costs)}});
    }
  }
  return all;
}

namespace {

/// What the reference or a prediction says of one set under one executor.
struct TimersOnly {
  double imu_lost_percent = 0, response_p50_ms = 0, response_p99_ms = 0;
};

struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  json to_json() const { return {low, high}; }
  bool meets(const Range& other, double slack) const {
    return low - slack <= other.high && other.low <= high + slack;
  }
};

struct Ranges {
  Range imu_lost, p50, p99;
  void add(const TimersOnly& t) {
    imu_lost.add(t.imu_lost_percent);
    p50.add(t.response_p50_ms);
    p99.add(t.response_p99_ms);
  }
  json to_json() const {
    return {{"imu_lost_percent", imu_lost.to_json()},
            {"response_authors_p50_ms", p50.to_json()},
            {"response_authors_p99_ms", p99.to_json()}};
  }
};

TimersOnly predict(const Graph& graph, const std::string& executor, Duration step) {
  GraphTasks tasks = make_tasks(graph);
  const auto first = make_phases(graph, tasks, Phases::creation, {step, 1});
  for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
  const Schedule s = simulate_timers(tasks.set, executor, reference_platform(*find_executor(executor)), 45s);
  TimersOnly t;
  for (TaskId id = 0; id < s.set.size(); ++id) {
    std::vector<double> responses;
    for (const ExecutedJob& job : s.jobs) {
      if (job.task == id && job.finished()) responses.push_back(to_ms(response_authors(s, job)));
    }
    if (s.set[id].name == "IMU") {
      const double timestamps = static_cast<double>(1 + (45s - 1ns - s.set[id].phase) / s.set[id].period);
      t.imu_lost_percent = 100 * (1 - static_cast<double>(responses.size()) / timestamps);
    }
    std::sort(responses.begin(), responses.end());
    t.response_p50_ms += quantile(responses, 0.5) / s.set.size();
    t.response_p99_ms += quantile(responses, 0.99) / s.set.size();
  }
  return t;
}

const std::map<std::string, std::string> kForkNames = {{"default", "default"},
                                                       {"static", "static"},
                                                       {"events", "events-ro"},
                                                       {"rm", "rm-ro"},
                                                       {"edf", "edf-ro"}};

}  // namespace

json validate_timers_only(const fs::path& reference) {
  using Run = std::pair<std::string, std::string>;  // utilisation, executor
  std::map<Run, std::map<std::string, std::pair<int, TimersOnly>>>
      measured;  // by repetition: tasks, their means
  for (CsvReader row(reference / "rclcpp_timers_only.csv"); row.next();) {
    const Run run(row.text("utilisation_percent"), row.text("executor"));
    auto& [tasks, t] = measured[run][std::string(row.text("repetition"))];
    ++tasks;
    t.response_p50_ms += row.number<double>("response_p50_ms");
    t.response_p99_ms += row.number<double>("response_p99_ms");
    if (row.text("task") == "IMU")
      t.imu_lost_percent = 100 * row.number<double>("dropped") / row.number<double>("released");
  }
  json all = json::array();
  for (const auto& [run, repetitions] : measured) {
    const auto executor = kForkNames.find(run.second);
    if (executor == kForkNames.end()) continue;
    const Graph graph = load_graph(find_graph("timers_only_" + run.first + "_authors"));
    Ranges real, simulated;
    for (const auto& [repetition, of_run] : repetitions) {
      TimersOnly t = of_run.second;
      t.response_p50_ms /= of_run.first;
      t.response_p99_ms /= of_run.first;
      real.add(t);
    }
    for (const Duration step : {2500us, 3000us, 3500us, 4000us, 4500us, 5000us}) {
      simulated.add(predict(graph, executor->second, step));
    }
    const bool lost_fits = real.imu_lost.meets(simulated.imu_lost, kSameLoss_percent);
    all.push_back(
        {{"set", graph.name},
         {"executor", executor->second},
         {"measured", real.to_json()},
         {"simulated", simulated.to_json()},
         {"verdict", lost_fits ? "lost jobs as measured"
                               : "lost jobs differ: the phases of these runs were not recorded, and they "
                                 "decide which timers share a window"}});
  }
  return all;
}

json validate_autoware(const fs::path& reference) {
  Graph graph = load_graph(find_graph("autoware"));
  for (Node& node : graph.nodes) {
    if (node.execution_time > Duration{}) node.execution_time = node.best_case_execution_time = 4220us;
  }
  const fs::path file = reference / "rclcpp_autoware_phases.csv";
  json all = json::array();
  for (CsvReader row(file); row.next();) {
    const std::string label(row.text("executor"));
    const std::string name = label.substr(0, label.find(' '));
    GraphTasks tasks = make_tasks(graph);
    const auto first = read_phases(file, graph, name);
    for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
    // Subscriptions before timers, and of two equals the earlier first, as the fork's heap has it.
    const ExecutorSpec executor = parse_executor(name, {SubscriptionRule::first, Ties::fifo, 2});
    SimulationOptions options;
    options.platform = reference_platform(*executor.entry);
    options.duration = 30s;
    const WorstCaseTimes times(tasks.set);
    // The six outputs of a hyperperiod (600 ms) differ: a whole number of them counts.
    const Prediction p = predict(graph, tasks, executor, times, options, 1200ms);
    const json simulated = latency_json(p.latencies_ms.at(0));
    const double measured = row.number<double>("hot_path_p50_ms");
    all.push_back(
        {{"executor", label},
         {"measured_ms", real_latency_json(row)},
         {"simulated_ms", simulated},
         {"verdict", median_verdict(measured, simulated.at("p50"), name == "multi" ? 0.10 : 0.05,
                                    "six outputs alternate, and costs decide which of two crunch counts "
                                    "the median falls on")}});
  }
  return all;
}

}  // namespace hotpath
