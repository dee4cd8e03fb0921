// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/phases.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::setup {

/// The accepted values of a number, both ends included.
struct Limits {
  double least, most;
};
/// --load and --rate in percent, and --copies.
inline constexpr Limits kLoads{0, 10000}, kRates{0.001, 1e6}, kCopies{1, 1000};

/// Command-line options that live and simulated runs share.
struct CommonOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors;
  std::vector<std::string> deployments;
  std::string entity_order = "creation";
  /// Replaces entity_order for a stored run, whose file may have changed since.
  std::vector<std::string> entity_tasks;
  double duration_s = 30, warm_up_s = 2;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  std::optional<double> load_percent;
  std::optional<double> rate_percent;
  unsigned copies = 1;
  std::optional<WorkMode> work;
  Phases phases = Phases::creation;
  std::string phases_file;
  std::string phases_of;  ///< Folder of a run whose first timestamps are used.
  std::optional<double> phase_step_ms;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  std::string output;
  std::vector<std::string> command;  ///< As given, without options that change no result.
};

/// Options of the simulated machine; the graph's `platform` supplies the missing values.
struct PlatformOptions {
  std::optional<unsigned> cores;
  std::optional<TimerThread> timer_thread;
  std::array<std::optional<double>, kPlatformCosts.size()> costs_us;  ///< Parallel to kPlatformCosts.

  void apply_to(GraphPlatform& platform) const;
};

Duration seconds(double s);

/// Local time by strftime's `format`.
std::string time_stamp(const char* format);

/// The folder for results: `output`, the value of --output, or if it is empty a new runs/DATE-NAME,
/// the same at every call. At the end of the program it is removed if it is empty.
std::string output_folder(const std::string& output, const std::string& name);
/// The same with the name of the graph.
std::string output_folder(const CommonOptions& options, const Graph& graph);

/// The graph of a run after applying --work, --load, --rate and --copies, in this order. Throws
/// InputError, UsageError.
Graph graph_to_run(const CommonOptions& options);

/// Options of the schedulers. Multi-threaded executors without a number of threads get one worker
/// per core, but at least 2; `cores` = 0: rclcpp's default. `set`: the tasks of the graph. Throws
/// InputError, UsageError for the order of entities.
[[nodiscard]] SchedulerOptions scheduling_of(const CommonOptions& options, const Graph& graph,
                                             const TaskSet& set, unsigned cores);

/// The requested executors and deployments. Throws InputError, UsageError, also for duplicates.
/// `cores`: as in scheduling_of().
[[nodiscard]] std::vector<ExecutorSpec> executors_to_run(const CommonOptions& options, const Graph& graph,
                                                         const GraphTasks& tasks, unsigned cores = 0);

/// First timestamps for one repetition of an executor. All executors of a repetition have the same
/// phases, unless a phases file distinguishes them. Throws InputError, UsageError.
std::vector<Duration> phases_of_repetition(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, const ExecutorSpec& executor,
                                           std::uint32_t repetition);

/// All (repetition, subject) in measurement order: one repetition after the other, each with its
/// subjects in random order, determined by the seed.
std::vector<std::pair<std::uint32_t, std::size_t>> interleaved(std::uint32_t repetitions,
                                                               std::size_t subjects, std::uint64_t seed);

/// Throws UsageError, ending with `remedy`, if the traces of `runs` repetitions and `more` bytes
/// exceed the memory.
void check_trace_memory(const CommonOptions& options, const GraphTasks& tasks, std::size_t runs, double more,
                        const std::string& remedy);

/// Sets the tasks' phases to the timers' first timestamps.
void set_phases(TaskSet& set, const std::vector<Duration>& first);

std::vector<std::string> chain_names(const Graph& graph);
results::SummaryOptions summary_options(const CommonOptions& options, const Graph& graph);

}  // namespace hotpath::setup
