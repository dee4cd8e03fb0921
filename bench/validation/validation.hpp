// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/csv.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/schedule.hpp"
#include "setup/run_setup.hpp"

/// What `hotpath validate` compares; how good it is, and why not better, says the template validation.txt.j2
/// of hotpath_report. The functions throw UsageError and InputError for files that cannot be read.
namespace hotpath {

/// What one of two runs of a task set did until the shorter one's last start.
struct ScheduleSide {
  std::size_t jobs = 0;
  std::map<std::string, double> lost_percent;  ///< By timer: of the timestamps until then.
  Quantiles start_lateness_ms;                 ///< Start minus timestamp.
  Quantiles response_ms;                       ///< Finish minus timestamp.
  Quantiles response_authors_ms;               ///< Timers.
};

/// Two runs of one task set side by side: what was measured, and what is held against it.
struct ScheduleComparison {
  double similarity = 0;  ///< Of the order of the first 10000 jobs (job_order.hpp).
  /// The same for the order by_period().
  double similarity_by_period = 0;
  struct Difference {
    std::size_t place = 0;
    double at_ms = 0;             ///< Start of the job that was measured.
    std::string measured, other;  ///< Tasks.
  };
  std::optional<Difference> first_difference;
  double largest_loss_difference_percent = 0;  ///< Of all timers.
  /// The order of jobs and the losses agree as well as the simulator is to meet the golden traces.
  bool agrees = false;
  ScheduleSide measured, other;
};
ScheduleComparison compare_schedules(const Schedule& measured, const Schedule& other);

/// Shares of lost jobs that differ by no more than this many points are the same.
inline constexpr double kSameLoss_percent = 2;

/// What a simulation says that a graph does.
struct SimulatedOutcome {
  Trace trace;
  std::vector<std::vector<double>> latencies_ms;  ///< Hot-path latencies of each chain after the warm-up.
};
SimulatedOutcome predict(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec& executor,
                         const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up);

/// What it says of timers whose jobs, as those of the golden programs and of the authors' nodes, work until
/// an instant of the clock.
Schedule predict_timers(const TaskSet& set, const ExecutorEntry& executor, Platform platform,
                        Duration duration);

/// Between the phases of `set` and the first timestamps of other timers of the same names.
double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first);

/// Hot-path latencies in milliseconds, by simulation, run or real stack.
struct LatencyQuantiles {
  std::optional<std::size_t> n;  ///< None: the source does not say.
  double p10 = kNoValue, p50 = kNoValue, p90 = kNoValue, p99 = kNoValue, max = kNoValue;
};

LatencyQuantiles latency_quantiles(std::vector<double> samples_ms);

/// Of a row of rclcpp_autoware_phases.csv.
LatencyQuantiles real_latencies(const CsvReader& row);

/// Whether two medians agree within a share `tolerance`.
bool medians_agree(const LatencyQuantiles& measured, const LatencyQuantiles& simulated, double tolerance);

/// The simulator against the real stack, job by job: one task set under one executor.
struct GoldenValidation {
  std::string set, executor;
  std::map<std::string, double> costs_us;  ///< As charged in `with_costs`.
  ScheduleComparison without_costs, with_costs;
};

/// All golden traces, REFERENCE/traces/SET.EXECUTOR.csv.
std::vector<GoldenValidation> validate_golden_traces(const std::filesystem::path& reference);

/// The least and the largest of several values.
using Range = std::array<double, 2>;
inline constexpr Range kNoRange = {INFINITY, -INFINITY};

/// What several runs of one set under one executor did.
struct TimersOnlyRanges {
  Range imu_lost_percent = kNoRange;
  /// The authors' response times, mean over tasks.
  Range response_authors_p50_ms = kNoRange, response_authors_p99_ms = kNoRange;
};

/// Lost jobs and the authors' response times of the real stack's longer runs. The phases of those runs are
/// unknown: predictions are ranges over creation steps.
struct TimersOnlyValidation {
  std::string set, executor;
  TimersOnlyRanges measured, simulated;
  bool agrees = false;  ///< The ranges of lost jobs have a value in common, or nearly so.
};

/// All of REFERENCE/rclcpp_timers_only.csv.
std::vector<TimersOnlyValidation> validate_timers_only(const std::filesystem::path& reference);

/// Hot-path latency of Autoware under one executor, with the real stack's phases.
struct AutowareValidation {
  std::string executor;  ///< As the reference names it.
  LatencyQuantiles measured_ms, simulated_ms;
  bool agrees = false;  ///< The medians do, within what one crunch more or less makes.
};

/// All of REFERENCE/rclcpp_autoware_phases.csv.
std::vector<AutowareValidation> validate_autoware(const std::filesystem::path& reference);

/// A run's schedule against the real stack's of the same task set under the same executor.
struct RunAgainstGolden {
  std::string set;
  double phases_differ_ms = 0;  ///< At most, of the timers' first releases.
  double real_busy_percent = 0, run_busy_percent = 0;
  ScheduleComparison comparison;  ///< Real stack, run.
  std::string phases_file;        ///< Of the real stack's phases.
};

/// Against the golden trace of the graph's task set under the same executor, if there is one.
std::optional<RunAgainstGolden> against_golden(const std::filesystem::path& reference,
                                               const std::string& graph, const Schedule& run,
                                               const ExecutorEntry& executor);

/// A run's hot-path latencies, after the warm-up.
struct RunLatencies {
  LatencyQuantiles measured_ms, simulated_ms;
  /// Autoware at the same load only: the real stack's, and by how much the phases differ at most.
  std::optional<LatencyQuantiles> real_ms;
  std::optional<double> phases_differ_ms;
  bool agrees = false;  ///< The medians of run and simulation do.
};

/// One executor and repetition of a stored run, live or simulated, against the simulation with its phases,
/// measured execution times and own costs, and against what the reference has of the real stack on the same
/// graph.
struct RunValidation {
  std::string run, executor;  ///< Folder, label.
  std::uint32_t repetition = 0;
  std::map<std::string, double> costs_us;  ///< As charged: those of a live run from its own gaps.
  ScheduleComparison comparison;           ///< Run, simulation.
  std::optional<RunLatencies> latencies;   ///< Of graphs with chains.
  std::optional<RunAgainstGolden> golden;
};

/// Every executor and repetition of a run, in the order of the executors.
std::vector<RunValidation> validate_run(const std::filesystem::path& run,
                                        const std::filesystem::path& reference);

/// Everything that `hotpath validate` finds out.
struct Validation {
  std::vector<GoldenValidation> golden;
  std::vector<TimersOnlyValidation> timers_only;
  std::vector<AutowareValidation> autoware;
  std::vector<RunValidation> runs;
};

/// As in validation.json. Units are the endings of keys.
void to_json(nlohmann::json& j, const Validation& validation);

}  // namespace hotpath
