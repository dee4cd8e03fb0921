// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/fastdds/options.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/work.hpp"
#include "machine/machine.hpp"
#include "program/json_record.hpp"
#include "results/measures.hpp"

namespace hotpath::results {

struct Repetition;

enum class RunKind : std::uint8_t {
  live,
  simulated,
  recorded,  ///< Imported from a trace of another system.
};
constexpr auto enum_texts(RunKind) { return texts_in_order<RunKind>({"live", "simulated", "recorded"}); }

/// An input file of the run, of which its folder holds a copy.
struct InputRecord {
  std::string kind;      ///< `graph`, `deployment_N` or `times`.
  std::string file;      ///< Name of the copy.
  std::string original;  ///< Absolute path.
  std::string hash;      ///< Of the content (FNV-1a).

  friend bool operator==(const InputRecord&, const InputRecord&) = default;
};
HOTPATH_FIELDS(InputRecord, kind, file, original, hash);

struct GraphRecord {
  std::string name;
  std::size_t nodes = 0;
  std::string file;  ///< The name or path that was given.
};
HOTPATH_FIELDS(GraphRecord, name, nodes, file);

/// One executor of a deployment, with the names of its tasks.
struct DeployedExecutorRecord : DeployedExecutor {
  std::uint32_t first_worker = 0, workers = 0;  ///< Range of the column `worker`.
  std::vector<std::string> tasks;
};
HOTPATH_FIELDS(DeployedExecutorRecord, name, executor, policy, processors, process, first_worker, workers,
               tasks);

struct DeploymentRecord {
  std::string name;
  std::string file;  ///< Empty for a preset.
  std::vector<DeployedExecutorRecord> executors;
};
HOTPATH_FIELDS(DeploymentRecord, name, file, executors);

/// A line in figures of the first chain (ChainLimits).
struct LimitRecord {
  std::string label;
  Duration latency{};
};
void fields(auto& visit, program::MaybeConst<LimitRecord> auto& limit) {
  visit("label", limit.label);
  visit.ms("ms", limit.latency);
}

/// The tightest bound of a timer's response time, in sets of timers alone.
struct BoundRecord {
  std::string executor;
  std::string task;
  Duration response{};
  std::string method;
};
void fields(auto& visit, program::MaybeConst<BoundRecord> auto& part) {
  HOTPATH_VISIT(executor, task, method)
  visit.ms("ms", part.response);
}

/// One repetition of one executor, besides its rows in the CSV files.
struct RepetitionRecord {
  std::string executor;
  std::uint32_t repetition = 0;
  std::map<std::string, Duration> first_timestamps;     ///< By timer, from the epoch.
  std::map<std::string, std::uint64_t> expected;        ///< TaskAccount::expected by task.
  std::map<std::string, std::uint64_t> hot_path_drops;  ///< By chain.
  ProcessUsage usage;
  std::uint64_t lost_records = 0;
  std::string failure;  ///< One sentence; empty: none.
  /// Live: the thread policy that each worker obtained, and whether the repetition was published.
  std::optional<std::vector<std::string>> thread_policies;
  std::optional<bool> published;

  /// Throws std::out_of_range for a task that it does not have.
  [[nodiscard]] std::uint64_t expected_of(const std::string& task) const;
};
void fields(auto& visit, program::MaybeConst<RepetitionRecord> auto& part) {
  HOTPATH_VISIT(executor, repetition, expected, hot_path_drops, usage, lost_records, failure)
  visit.ms("first_timestamps_ms", part.first_timestamps);
  visit.if_any("thread_policies", part.thread_policies);
  visit.if_any("live", part.published);
}

/// What run.json stores of a repetition. `set` has its phases; `chains` are those of its chain records.
[[nodiscard]] RepetitionRecord record_of(const TaskSet& set, const std::vector<std::string>& chains,
                                         const Repetition& repetition);

/// Settings of a run in virtual time, and of one that was imported. Its keys stand beside those of RunRecord.
struct SimulationRecord {
  GraphPlatform platform;       ///< Without the model of execution times.
  std::string execution_times;  ///< As --execution-times takes it, or `recorded` of an imported run.
  std::optional<std::uint64_t> max_backlog = {};
  bool no_trace = false;
  bool drawn = false;  ///< Execution times or releases depend on the seed.
};
void visit_fields(auto& visit, program::MaybeConst<SimulationRecord> auto& simulation) {
  visit("platform", simulation.platform);
  visit("execution_times", simulation.execution_times);
  visit.if_any("max_backlog", simulation.max_backlog);
  visit.unless(false, "no_trace", simulation.no_trace);
  visit.unless(false, "drawn", simulation.drawn);
}

/// What a live run stores of the plan of its repetitions.
struct LiveSettings {
  TransportKind transport = TransportKind::fastdds;
  FastDdsOptions fastdds;
  std::uint32_t processes = 1;
  std::vector<int> cpus, live_cpus;  ///< Of the executors, and of the process that publishes; empty: all.
  bool all_interfaces = false, lock_memory = false, cpu_time = false;
  std::optional<Calibration> calibration;  ///< For a fixed amount of work.
};

/// Settings of a live run, and the machine that it ran on; likewise.
struct LiveRecord : LiveSettings {
  std::string date;
  std::vector<std::string> stacks;
  std::string executor_policy, timer_policy;  ///< Empty: the defaults of the executors.
  machine::Machine machine;
};
void visit_fields(auto& visit, program::MaybeConst<LiveRecord> auto& part) {
  HOTPATH_VISIT(date, transport, stacks, processes, all_interfaces, executor_policy, timer_policy,
                lock_memory, cpu_time, cpus, live_cpus, machine)
  visit("network", part.fastdds.network);
  visit("domain", part.fastdds.domain);
  visit.if_any("calibration", part.calibration);
}

/// The options of a run that run.json stores as they are.
struct RunOptions {
  std::vector<std::string> command;  ///< As given, without what changes no result; empty: imported.
  std::vector<std::string> set;      ///< `NODE.KEY=VALUE`, which load_graph() sets in the graph's file.
  std::optional<double> load_given, rate_percent;
  unsigned copies = 1;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  std::vector<std::string> entity_tasks;  ///< A stored run's order itself; empty: that of creation.
  std::uint32_t repetitions = 1;
  double duration_s = 0, warm_up_s = 0;
  std::uint64_t seed = 1;
  std::string phases_file;
  std::optional<double> phase_step_ms;
};

/// The content of run.json: everything that a reader of a run must know, and that a run with the same results
/// needs. Every command reads and writes run.json through this type.
struct RunRecord : RunOptions {
  RunKind kind = RunKind::simulated;
  std::string version;    ///< Of hotpath.
  std::string revision;   ///< Of its sources, by git; empty: unknown.
  bool complete = false;  ///< All repetitions are stored, and none failed.
  bool partial = false;   ///< Interrupted, or recovered after a kill.

  GraphRecord graph;
  std::vector<InputRecord> inputs;
  TaskSet tasks;  ///< Without the phases of a repetition.
  std::vector<std::string> chains;
  double load_percent = 0;  ///< Of one core.
  WorkMode work = WorkMode::fixed;

  std::vector<std::string> executors;  ///< Labels, in the order given; deployments included.
  std::map<std::string, DeploymentRecord> deployments;
  std::string entity_order = "creation";  ///< As --entity-order takes it.
  std::string phases;                     ///< A word of Phases, or `as in RUN`.

  std::optional<SimulationRecord> simulation;
  std::optional<LiveRecord> live;
  std::vector<LimitRecord> limits;
  std::vector<BoundRecord> bounds;
  std::vector<RepetitionRecord> runs;  ///< In the order in which they ended.
  std::vector<std::string> warnings, failures;

  /// Processors that the run could use.
  [[nodiscard]] unsigned cores() const {
    return live ? static_cast<unsigned>(live->cpus.size()) : simulation ? simulation->platform.cores : 1;
  }
  /// `command` as a shell takes it.
  [[nodiscard]] std::string command_line() const;
};
void visit_fields(auto& visit, program::MaybeConst<RunRecord> auto& part) {
  HOTPATH_VISIT(kind, version, complete, partial, graph, chains, load_percent, load_given, work, executors,
                deployments, entity_order, rule, ties, repetitions, seed, phases, limits, bounds, runs,
                warnings, failures)
  constexpr double kLongestS = 1e9;
  visit.up_to(kLongestS, "duration_s", part.duration_s);
  visit.up_to(kLongestS, "warm_up_s", part.warm_up_s);
  visit.unless({}, "command", part.command);
  visit.unless({}, "set", part.set);
  visit.if_any("rate_percent", part.rate_percent);
  visit.unless(1, "copies", part.copies);
  visit.unless({}, "inputs", part.inputs);
  visit.unless({}, "revision", part.revision);
  visit.unless({}, "entity_tasks", part.entity_tasks);
  visit.unless({}, "phases_file", part.phases_file);
  visit.if_any("phase_step_ms", part.phase_step_ms);
}

/// The second throws nlohmann's exceptions or std::logic_error for what is no run.json.
void to_json(nlohmann::json& j, const RunRecord& record);
void from_json(const nlohmann::json& j, RunRecord& record);

}  // namespace hotpath::results
