// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/phases.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

/// What live and simulated runs are told alike on the command line.
struct CommonOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors;
  std::vector<std::string> deployments;
  std::string entity_order = "creation";
  /// In that order, in place of entity_order: of a stored run, whose file may have changed since.
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
  std::optional<double> phase_step_ms;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  std::string output;
  std::vector<std::string> command;  ///< As given, without what changes no result.
};

/// What the options say of the simulated machine; what is left open follows from the graph's `platform`.
struct PlatformOptions {
  std::optional<unsigned> cores;
  std::optional<TimerThread> timer_thread;
  std::array<std::optional<double>, kPlatformCosts.size()> costs_us;  ///< Parallel to kPlatformCosts.

  void apply_to(GraphPlatform& platform) const;
};

Duration seconds(double s);

/// Local time by strftime's `format`.
std::string time_stamp(const char* format);

/// Where results go: what --output says, or runs/DATE-GRAPH.
std::string output_folder(const CommonOptions& options, const Graph& graph);

/// The graph of a run, with the work, load, rate and copies asked for, in this order. Throws InputError,
/// UsageError.
Graph graph_to_run(const CommonOptions& options);

/// How schedulers are made. Those with many workers that are not told how many have as many as there are
/// `cores`, but 2 at least; 0: rclcpp's default. Throws InputError, UsageError for the order of entities.
[[nodiscard]] SchedulerOptions scheduling_of(const CommonOptions& options, const TaskSet& set,
                                             unsigned cores);

/// The executors and deployments asked for. Throws InputError, UsageError, also for one named twice. `cores`:
/// as in scheduling_of().
[[nodiscard]] std::vector<ExecutorSpec> executors_to_run(const CommonOptions& options, const Graph& graph,
                                                         const GraphTasks& tasks, unsigned cores = 0);

/// First timestamps for one repetition of an executor: the same for all executors of a repetition, except
/// where a file of phases tells them apart. Throws InputError, UsageError.
std::vector<Duration> phases_of_repetition(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, const ExecutorSpec& executor,
                                           std::uint32_t repetition);

/// All (repetition, subject) in the order in which they are measured: repetitions one after the other, each
/// with its subjects in random order, which the seed decides.
std::vector<std::pair<std::uint32_t, std::size_t>> interleaved(std::uint32_t repetitions,
                                                               std::size_t subjects, std::uint64_t seed);

/// Refuses traces that would not fit into the memory: those of `runs` repetitions, and `more` bytes. Throws
/// UsageError, which ends with `remedy`.
void check_trace_memory(const CommonOptions& options, const GraphTasks& tasks, std::size_t runs, double more,
                        const std::string& remedy);

/// Takes first timestamps of timers as the tasks' phases.
void set_phases(TaskSet& set, const std::vector<Duration>& first);

std::vector<std::string> chain_names(const Graph& graph);
std::vector<MeasuredChain> measured_chains(const Graph& graph, const GraphTasks& tasks);
SummaryOptions summary_options(const CommonOptions& options, const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath
