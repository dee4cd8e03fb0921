// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

using namespace std::chrono_literals;

/// Path of the golden trace of a task set under an executor; the file may be missing.
fs::path golden_trace_file(const fs::path& reference, const std::string& set, const ExecutorEntry& executor) {
  return reference / "traces" / (set + "." + std::string(executor.name) + ".csv");
}

/// The schedule of the real stack.
results::Schedule golden_schedule(const fs::path& file, const ExecutorEntry& executor) {
  return results::schedule_of(read_golden_trace(file), executor.traits.timers == TimerHandling::release_only);
}

/// Simulates timers whose jobs work until an instant of the clock, as in the golden programs and
/// the authors' nodes.
results::Schedule predict_timers(const TaskSet& set, const ExecutorEntry& executor, Platform platform,
                                 Duration duration) {
  platform.wall_clock_work = true;
  const WorstCaseTimes times(set);
  PublishingWorkload workload(times);
  SimulationOptions options;
  options.platform = platform;
  options.duration = duration;
  return results::schedule_of(set, simulate_trace(set, executor, {}, workload, options));
}

json golden_row(const std::string& set, const ExecutorEntry& executor, const fs::path& file) {
  const results::Schedule real = golden_schedule(file, executor);
  if (real.jobs.empty()) throw program::UsageError("the golden trace " + file.string() + " has no jobs");
  const Duration length = real.jobs.back().start - Time{} + Duration(1);
  const Platform costs = reference_platform(executor, real.set.size());
  return {{"set", set},
          {"executor", executor.name},
          {"costs_us",
           {{"dispatch", to_us(costs.longest_dispatch_cost())},
            {"wait", to_us(costs.wait_cost + costs.other_entities * costs.wait_cost_per_entity)},
            {"wake_up", to_us(costs.wake_up_latency)}}},
          {"without_costs", compare_schedules(real, predict_timers(real.set, executor, {}, length))},
          {"with_costs", compare_schedules(real, predict_timers(real.set, executor, costs, length))}};
}

std::set<std::string> recorded_sets(const fs::path& traces) {
  std::set<std::string> sets;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(traces, error))
    if (file.path().extension() == ".csv") sets.insert(file.path().stem().stem());
  const std::string remedy = "name the folder of the reference measurements";
  if (error) refuse_input(traces.string(), error.message(), remedy);
  if (sets.empty()) throw InputError(traces.string(), 0, "has no file SET.EXECUTOR.csv", remedy);
  return sets;
}

/// Time in which jobs ran, in percent of the time until the last finish.
double busy_percent(const results::Schedule& schedule) {
  Duration busy{};
  Time end{};
  for (const results::ExecutedJob& job : schedule.jobs) {
    if (job.outcome != Outcome::ran) continue;
    busy += job.duration();
    end = std::max(end, job.finish);
  }
  return end > Time{} ? 100 * to_ms(busy) / to_ms(end - Time{}) : 0;
}

/// Measures of one run of a set of timers; the authors' response times are means over tasks.
struct TimersOnlyRun {
  double imu_lost_percent = 0, response_p50_ms = 0, response_p99_ms = 0;
};
using TimersOnlyRuns = std::vector<TimersOnlyRun>;

std::pair<double, double> range(const TimersOnlyRuns& runs, double TimersOnlyRun::*measure) {
  const auto [least, most] = std::ranges::minmax_element(runs, {}, measure);
  return {*least.*measure, *most.*measure};
}

json ranges_json(const TimersOnlyRuns& runs) {
  return {{"imu_lost_percent", range(runs, &TimersOnlyRun::imu_lost_percent)},
          {"response_authors_p50_ms", range(runs, &TimersOnlyRun::response_p50_ms)},
          {"response_authors_p99_ms", range(runs, &TimersOnlyRun::response_p99_ms)}};
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
    for (const results::ExecutedJob& job : s.jobs)
      if (job.job.task == id && job.outcome == Outcome::ran)
        responses.push_back(to_ms(results::response_authors(s, job)));
    if (s.set[id].name == "IMU") {
      const auto timestamps = static_cast<double>(timestamps_in(s.set[id], Time{}, Time{} + kLength));
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

std::map<Subject, TimersOnlyRuns> read_measured(const fs::path& file) {
  std::map<std::pair<Subject, std::string>, std::pair<int, TimersOnlyRun>> by_repetition;
  CsvReader row(file);
  static_cast<void>(row.column("utilisation_percent"));  // checks the header even without rows
  while (row.next()) {
    const Subject subject(row.text("utilisation_percent"), row.text("executor"));
    auto& [tasks, run] = by_repetition[{subject, std::string(row.text("repetition"))}];
    ++tasks;
    run.response_p50_ms += row.number<double>("response_p50_ms");
    run.response_p99_ms += row.number<double>("response_p99_ms");
    if (row.text("task") == "IMU")
      run.imu_lost_percent = 100 * row.number<double>("dropped") / row.number<double>("released");
  }
  std::map<Subject, TimersOnlyRuns> measured;
  for (const auto& [key, sum] : by_repetition) {
    const auto& [tasks, run] = sum;
    measured[key.first].push_back(
        {run.imu_lost_percent, run.response_p50_ms / tasks, run.response_p99_ms / tasks});
  }
  return measured;
}

/// The hot-path latencies (ms) of Autoware with the phases of the real stack.
std::vector<double> autoware_latencies(const Graph& graph, const GraphTasks& tasks,
                                       const setup::ExecutorSpec& executor) {
  // The six outputs of a hyperperiod (600 ms) differ: whole hyperperiods are counted.
  constexpr Duration kWarmUp = 1200ms;
  const WorstCaseTimes times(tasks.set);
  std::vector<ChainObservation> observations;
  GraphWorkload workload(graph, tasks, times, &observations);
  SimulationOptions options;
  options.platform = reference_platform(*executor.entry, static_cast<std::uint32_t>(graph.nodes.size()));
  options.duration = 30s;
  static_cast<void>(simulate_trace(tasks.set, *executor.entry, executor.scheduler, workload, options));
  std::vector<double> latencies;
  for (const ChainObservation& o : observations) {
    if (o.chain == 0 && o.sink_start >= Time{} + kWarmUp)
      latencies.push_back(to_ms(o.sink_start - o.latest_source_start));
  }
  return latencies;
}

}  // namespace

json golden_rows(const fs::path& reference) {
  json rows = json::array();
  for (const std::string& set : recorded_sets(reference / "traces"))
    for (const ExecutorEntry& executor : executors())
      if (const fs::path file = golden_trace_file(reference, set, executor); fs::exists(file))
        rows.push_back(golden_row(set, executor, file));
  return rows;
}

json against_golden(const fs::path& reference, const std::string& graph, const results::Schedule& run,
                    const ExecutorEntry& executor) {
  const std::string set = graph.substr(0, graph.find("_authors"));
  const fs::path file = golden_trace_file(reference, set, executor);
  if (!fs::exists(file)) return nullptr;
  const results::Schedule real = golden_schedule(file, executor);
  const auto timer = [](const Task& task) { return std::pair(task.name, task.period); };
  if (!std::ranges::equal(real.set.tasks, run.set.tasks, {}, timer, timer)) return nullptr;
  std::vector<Duration> first;
  for (const Task& task : run.set.tasks) first.push_back(task.phase);
  return {{"set", set},
          {"phases_differ_ms", largest_phase_difference_ms(real.set, first)},
          {"real_busy_percent", busy_percent(real)},
          {"run_busy_percent", busy_percent(run)},
          {"comparison", compare_schedules(real, run)},
          {"phases_file", file.filename().string()}};
}

json timers_only_rows(const fs::path& reference) {
  json rows = json::array();
  for (const auto& [subject, measured] : read_measured(reference / "rclcpp_timers_only.csv")) {
    const ExecutorEntry* const executor = find_executor(subject.second);
    if (executor == nullptr) continue;
    const Graph graph = load_graph(find_graph("timers_only_" + subject.first + "_authors"));
    TimersOnlyRuns simulated;
    for (const Duration step : {2500us, 3000us, 3500us, 4000us, 4500us, 5000us})
      simulated.push_back(predict(graph, *executor, step));
    const auto [least, most] = range(measured, &TimersOnlyRun::imu_lost_percent);
    const auto [our_least, our_most] = range(simulated, &TimersOnlyRun::imu_lost_percent);
    rows.push_back(
        {{"set", graph.name},
         {"executor", executor->name},
         {"measured", ranges_json(measured)},
         {"simulated", ranges_json(simulated)},
         {"agrees", least - kSameLoss_percent <= our_most && our_least <= most + kSameLoss_percent}});
  }
  return rows;
}

json autoware_rows(const fs::path& reference) {
  Graph graph = load_graph(find_graph("autoware"));
  for (Node& node : graph.nodes) {
    for (Callback& callback : node.callbacks)
      if (callback.worst > Duration{}) callback.worst = callback.best = 4220us;
  }
  const fs::path file = reference / "rclcpp_autoware_phases.csv";
  json rows = json::array();
  CsvReader row(file);
  static_cast<void>(row.column("executor"));
  while (row.next()) {
    const std::string label(row.text("executor")), name = label.substr(0, label.find(' '));
    GraphTasks tasks = make_tasks(graph);
    setup::set_phases(tasks.set, read_phases(file, graph, name));
    // As in the fork's heap: subscriptions before timers, and the earlier of two equal jobs first.
    const setup::ExecutorSpec executor =
        setup::parse_executor(name, {SubscriptionRule::first, Ties::fifo, 2});
    const double tolerance = executor.entry->traits.many_workers ? 0.10 : 0.05;
    rows.push_back(
        compare_latencies(real_latencies(row), autoware_latencies(graph, tasks, executor), tolerance));
    rows.back()["executor"] = label;
  }
  return rows;
}

}  // namespace hotpath::validation
