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

/// The comparisons of `hotpath diff --simulated` and `paper golden`; the template validation.txt.j2 of
/// hotpath_report explains their quality and limits. The functions throw UsageError and InputError for
/// unreadable files.
namespace hotpath::validation {

/// One of two runs of a task set, until the shorter one's last start.
struct ScheduleSide {
  std::size_t jobs = 0;
  std::map<std::string, double> lost_percent;  ///< By timer: of the timestamps until then.
  Quantiles start_lateness_ms;                 ///< Start minus timestamp.
  Quantiles response_ms;                       ///< Finish minus timestamp.
  Quantiles response_authors_ms;               ///< Timers.
};

/// Two runs of one task set side by side: a measured one, and another one.
struct ScheduleComparison {
  double similarity = 0;  ///< Of the order of the first 10000 jobs (job_order.hpp).
  /// The same with the order by_period().
  double similarity_by_period = 0;
  struct Difference {
    std::size_t place = 0;
    double at_ms = 0;             ///< Start of the measured job.
    std::string measured, other;  ///< Tasks.
  };
  std::optional<Difference> first_difference;
  double largest_loss_difference_percent = 0;  ///< Over all timers.
  /// Order of jobs and losses agree within the simulator's tolerances for golden traces.
  bool agrees = false;
  ScheduleSide measured, other;
};
ScheduleComparison compare_schedules(const results::Schedule& measured, const results::Schedule& other);

/// Shares of lost jobs agree up to this difference in percentage points.
inline constexpr double kSameLoss_percent = 2;

/// The result of simulating a graph.
struct SimulatedOutcome {
  Trace trace;
  std::vector<std::vector<double>> latencies_ms;  ///< Hot-path latencies of each chain after the warm-up.
};
SimulatedOutcome predict(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor,
                         const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up);

/// Simulates timers whose jobs work until an instant of the clock, as in the golden programs and
/// the authors' nodes.
results::Schedule predict_timers(const TaskSet& set, const ExecutorEntry& executor, Platform platform,
                                 Duration duration);

/// The largest difference between the phases of `set` and other first timestamps, by task.
double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first);

/// Hot-path latencies (ms) of a simulation, a run or the real stack.
struct LatencyQuantiles {
  std::optional<std::size_t> n;  ///< None: unknown.
  double p10 = kNoValue, p50 = kNoValue, p90 = kNoValue, p99 = kNoValue, max = kNoValue;
};

LatencyQuantiles latency_quantiles(std::vector<double> samples_ms);

/// The latencies in a row of rclcpp_autoware_phases.csv.
LatencyQuantiles real_latencies(const CsvReader& row);

/// The simulated median compared with the measured one.
struct MedianComparison {
  double differs_percent = kNoValue;  ///< Of the measured median; kNoValue if this is 0.
  bool agrees = false;                ///< Within a tolerance.
};
MedianComparison compare_medians(const LatencyQuantiles& measured, const LatencyQuantiles& simulated,
                                 double tolerance);

/// The simulator compared with the real stack, job by job, for one task set under one executor.
struct GoldenValidation {
  std::string set, executor;
  std::map<std::string, double> costs_us;  ///< As charged in `with_costs`.
  ScheduleComparison without_costs, with_costs;
};

/// Validates all golden traces, REFERENCE/traces/SET.EXECUTOR.csv.
std::vector<GoldenValidation> validate_golden_traces(const std::filesystem::path& reference);

/// The smallest and the largest of several values.
using Range = std::array<double, 2>;
inline constexpr Range kNoRange = {INFINITY, -INFINITY};

/// Measures of several runs of one set under one executor.
struct TimersOnlyRanges {
  Range imu_lost_percent = kNoRange;
  /// The authors' response times, mean over tasks.
  Range response_authors_p50_ms = kNoRange, response_authors_p99_ms = kNoRange;
};

/// Lost jobs and the authors' response times of the real stack's longer runs. The phases of those
/// runs are unknown: predictions are ranges over creation steps.
struct TimersOnlyValidation {
  std::string set, executor;
  TimersOnlyRanges measured, simulated;
  bool agrees = false;  ///< The ranges of lost jobs overlap or nearly overlap.
};

/// Validates all rows of REFERENCE/rclcpp_timers_only.csv.
std::vector<TimersOnlyValidation> validate_timers_only(const std::filesystem::path& reference);

/// Hot-path latency of Autoware under one executor, with the real stack's phases.
struct AutowareValidation {
  std::string executor;  ///< As the reference names it.
  LatencyQuantiles measured_ms, simulated_ms;
  MedianComparison median;  ///< Agrees within 5 %, with several workers 10 %.
};

/// Validates all rows of REFERENCE/rclcpp_autoware_phases.csv.
std::vector<AutowareValidation> validate_autoware(const std::filesystem::path& reference);

/// A run's schedule compared with the real stack's schedule of the same task set and executor.
struct RunAgainstGolden {
  std::string set;
  double phases_differ_ms = 0;  ///< Largest difference of the timers' first releases.
  double real_busy_percent = 0, run_busy_percent = 0;
  ScheduleComparison comparison;  ///< Real stack, run.
  std::string phases_file;        ///< Of the real stack's phases.
};

/// Compares with the golden trace of the graph's task set under the same executor, if there is one.
std::optional<RunAgainstGolden> against_golden(const std::filesystem::path& reference,
                                               const std::string& graph, const results::Schedule& run,
                                               const ExecutorEntry& executor);

/// A run's hot-path latencies, after the warm-up.
struct RunLatencies {
  LatencyQuantiles measured_ms, simulated_ms;
  /// Only for Autoware at the same load: latencies of the real stack, largest difference of phases.
  std::optional<LatencyQuantiles> real_ms;
  std::optional<double> phases_differ_ms;
  MedianComparison median;  ///< Of run and simulation.
};

/// One executor and repetition of a stored run, live or simulated, compared with a simulation of
/// its phases, measured execution times and costs, and with the real stack on the same graph, where
/// the reference has it.
struct RunValidation {
  std::string run, executor;  ///< Folder, label.
  std::uint32_t repetition = 0;
  std::map<std::string, double> costs_us;  ///< As charged; for a live run from its gaps.
  ScheduleComparison comparison;           ///< Run, simulation.
  std::optional<RunLatencies> latencies;   ///< Of graphs with chains.
  std::optional<RunAgainstGolden> golden;
};

/// Validates every executor and repetition of a run, in the order of the executors.
std::vector<RunValidation> validate_run(const std::filesystem::path& run,
                                        const std::filesystem::path& reference);

/// The results of `hotpath diff --simulated` and `paper golden`.
struct Validation {
  std::vector<GoldenValidation> golden;
  std::vector<TimersOnlyValidation> timers_only;
  std::vector<AutowareValidation> autoware;
  std::vector<RunValidation> runs;
};

/// Validates stored runs; stores the result in `output` (by default a new folder of runs/), prints
/// and draws it. Throws UsageError, InputError.
void validate_runs(const std::vector<std::string>& runs, const std::string& output);

/// The same for the simulator against the real stack, on all reference measurements in `reference`
/// (by default as installed with hotpath).
void validate_simulator(const std::string& reference, const std::string& output);

/// The content of validation.json. Keys end with their units.
void to_json(nlohmann::json& j, const Validation& validation);

}  // namespace hotpath::validation
