// SPDX-License-Identifier: Apache-2.0
#include "validation/timers_only_validation.hpp"

#include <algorithm>
#include <map>

#include "hotpath/core/csv.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "validation/prediction.hpp"
#include "validation/schedule_comparison.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// What one run did: response times are means over tasks.
struct TimersOnlyRun {
  double imu_lost_percent = 0, response_p50_ms = 0, response_p99_ms = 0;
};

void add(TimersOnlyRanges& ranges, const TimersOnlyRun& run) {
  ranges.imu_lost_percent.add(run.imu_lost_percent);
  ranges.response_authors_p50_ms.add(run.response_p50_ms);
  ranges.response_authors_p99_ms.add(run.response_p99_ms);
}

TimersOnlyRun predict(const Graph& graph, const ExecutorEntry& executor, Duration step) {
  constexpr Duration kLength = 45s;
  GraphTasks tasks = make_tasks(graph);
  const auto first = make_phases(graph, tasks, Phases::creation, {step, 1});
  for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
  const Schedule s = predict_timers(tasks.set, executor, reference_platform(executor), kLength);
  TimersOnlyRun run;
  for (TaskId id = 0; id < s.set.size(); ++id) {
    std::vector<double> responses;
    for (const ExecutedJob& job : s.jobs) {
      if (job.task == id && job.finished()) responses.push_back(to_ms(response_authors(s, job)));
    }
    if (s.set[id].name == "IMU") {
      const double timestamps = static_cast<double>(1 + (kLength - 1ns - s.set[id].phase) / s.set[id].period);
      run.imu_lost_percent = 100 * (1 - static_cast<double>(responses.size()) / timestamps);
    }
    std::sort(responses.begin(), responses.end());
    run.response_p50_ms += quantile(responses, 0.5) / s.set.size();
    run.response_p99_ms += quantile(responses, 0.99) / s.set.size();
  }
  return run;
}

/// The set's utilisation and the executor's name there.
using Subject = std::pair<std::string, std::string>;

std::map<Subject, TimersOnlyRanges> read_measured(const fs::path& file) {
  struct Sum {
    int tasks = 0;
    TimersOnlyRun run;
  };
  std::map<Subject, std::map<std::string, Sum>> by_repetition;
  for (CsvReader row(file); row.next();) {
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
    for (auto [repetition, sum] : repetitions) {
      sum.run.response_p50_ms /= sum.tasks;
      sum.run.response_p99_ms /= sum.tasks;
      add(measured[subject], sum.run);
    }
  }
  return measured;
}

/// The fork that was measured has release-only timers and does not say so in its names.
const ExecutorEntry* executor_of_fork(const std::string& name) {
  const ExecutorEntry* const executor = find_executor(name);
  return executor != nullptr ? executor : find_executor(name + "-ro");
}

}  // namespace

void Range::add(double x) {
  low = std::min(low, x);
  high = std::max(high, x);
}

bool Range::meets(const Range& other, double slack) const {
  return low - slack <= other.high && other.low <= high + slack;
}

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
    const bool lost_fits = measured.imu_lost_percent.meets(simulated.imu_lost_percent, kSameLoss_percent);
    all.push_back({graph.name, std::string(executor->name), measured, simulated,
                   lost_fits ? "lost jobs as measured"
                             : "lost jobs differ: the phases of these runs were not recorded, and they "
                               "decide which timers share a window"});
  }
  return all;
}

}  // namespace hotpath
