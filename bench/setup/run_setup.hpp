// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/phases.hpp"
#include "results/run_record.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::setup {

/// The accepted values of a number, both ends included.
struct Limits {
  double least, most;
};
/// --load and --rate in percent, and --copies.
inline constexpr Limits kLoads{0, 10000}, kRates{0.001, 1e6}, kCopies{1, 1000};

/// Where the execution times of a simulation come from: one of these.
struct TimesSource {
  std::optional<ExecutionTimeModel> model = ExecutionTimeModel::worst;
  std::string replay = {};  ///< Folder of a run.
  std::string listed = {};  ///< CSV file of jobs.

  /// Parses a word of ExecutionTimeModel, `replay:RUN` or `listed:FILE`.
  [[nodiscard]] static std::optional<TimesSource> parse(const std::string& text) {
    if (const auto model = hotpath::parse<ExecutionTimeModel>(text)) return TimesSource{model};
    if (text.starts_with("replay:")) return TimesSource{{}, text.substr(text.find(':') + 1)};
    if (text.starts_with("listed:")) return TimesSource{{}, {}, text.substr(text.find(':') + 1)};
    return std::nullopt;
  }
  [[nodiscard]] std::string text() const {
    return model ? to_string(*model) : replay.empty() ? "listed:" + listed : "replay:" + replay;
  }
};

/// The order in which wait sets scan their entities: by default that of creation.
struct EntityOrder {
  bool reverse = false;
  std::string file = {};  ///< Of task names; empty: none.

  /// Parses `creation`, `reverse` or the name of a file.
  [[nodiscard]] static EntityOrder parse(const std::string& text) {
    const bool reverse = text == "reverse";
    return {reverse, reverse || text == "creation" ? "" : text};
  }
  [[nodiscard]] std::string text() const { return reverse ? "reverse" : file.empty() ? "creation" : file; }
  friend bool operator==(const EntityOrder&, const EntityOrder&) = default;
};

/// Command-line options that live and simulated runs share.
struct CommonOptions : results::RunOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors, deployments;
  EntityOrder entity_order;
  std::optional<WorkMode> work;
  Phases phases = Phases::creation;
  std::string phases_of;  ///< Folder of a run whose first timestamps are used.
  std::string output;

  CommonOptions() { duration_s = 30, warm_up_s = 2; }
};

/// Options of the simulated machine; the graph's `platform` supplies the missing values.
struct PlatformOptions {
  std::optional<unsigned> cores;
  std::optional<TimerThread> timer_thread;
  std::array<std::optional<double>, kPlatformCosts.size()> costs_us;  ///< Parallel to kPlatformCosts.

  void apply_to(GraphPlatform& platform) const;
};

/// Local time by strftime's `format`.
std::string time_stamp(const char* format);

/// The folder for results: `output`, the value of --output, or if it is empty a new runs/DATE-NAME,
/// the same at every call. At the end of the program it is removed if it is empty.
std::string output_folder(const std::string& output, const std::string& name);

/// The graph of a run after applying --set, --work, --load, --rate and --copies, in this order. Throws
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
