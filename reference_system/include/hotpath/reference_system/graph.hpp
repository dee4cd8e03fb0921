// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/reference_system/callback.hpp"

namespace hotpath {

/// The six node types of the reference system (upstream's nodes/rclcpp/*.hpp), and one that is any of them.
enum class NodeType : std::uint8_t {
  sensor,        ///< Timer; publishes.
  transform,     ///< One input; works, publishes.
  fusion,        ///< Two inputs or more; works and publishes when it has a message of each.
  cyclic,        ///< Inputs are stored; its timer works and publishes every cycle.
  intersection,  ///< Independent transforms under one name: input i leads to output i.
  command,       ///< One input; the end of a chain.
  callbacks,     ///< Any timers and subscriptions, with any groups and publications.
};
constexpr auto enum_texts(NodeType) {
  return std::to_array<EnumText<NodeType>>({{NodeType::sensor, "sensor"},
                                            {NodeType::transform, "transform"},
                                            {NodeType::fusion, "fusion"},
                                            {NodeType::cyclic, "cyclic"},
                                            {NodeType::intersection, "intersection"},
                                            {NodeType::command, "command"},
                                            {NodeType::callbacks, "callbacks"}});
}

/// How a job burns its execution time.
enum class WorkMode : std::uint8_t {
  fixed,     ///< A fixed amount of work (upstream): preemption makes a job longer, not its work smaller.
  wall,      ///< Until an instant of the clock (the paper's task sets): preemption counts as work.
  cpu_time,  ///< Until the thread has used that much CPU time.
};
constexpr auto enum_texts(WorkMode) {
  return std::to_array<EnumText<WorkMode>>(
      {{WorkMode::fixed, "fixed"}, {WorkMode::wall, "wall"}, {WorkMode::cpu_time, "cpu_time"}});
}

/// OS priority of the timer management thread, compared with the executor thread's.
enum class TimerThread : std::uint8_t {
  by_executor,  ///< Raised under the paper's executors only, as in live runs.
  raised,
  equal,
};

/// How long the jobs of a simulation take.
enum class ExecutionTimeModel : std::uint8_t {
  worst,     ///< Always the worst case.
  uniform,   ///< Uniform between best and worst case.
  measured,  ///< Drawn from the measured values of callbacks that have some, uniform for the others.
  replayed,  ///< The same, but in the order in which they were measured, from a place that the seed decides.
};

constexpr auto enum_texts(TimerThread) {
  return std::to_array<EnumText<TimerThread>>({{TimerThread::by_executor, "by_executor"},
                                               {TimerThread::raised, "raised"},
                                               {TimerThread::equal, "equal"}});
}
constexpr auto enum_texts(ExecutionTimeModel) {
  return std::to_array<EnumText<ExecutionTimeModel>>({{ExecutionTimeModel::worst, "worst"},
                                                      {ExecutionTimeModel::uniform, "uniform"},
                                                      {ExecutionTimeModel::measured, "measured"},
                                                      {ExecutionTimeModel::replayed, "replayed"}});
}

/// The machine on which `hotpath simulate` runs a graph, unless its options say otherwise; see Platform.
struct GraphPlatform {
  unsigned cores = 1;  ///< In [1, kMaxWorkers].
  TimerThread timer_thread = TimerThread::by_executor;
  ExecutionTimeModel execution_times = ExecutionTimeModel::worst;
  Duration release_cost{}, pass_cost{}, dispatch_cost{}, wait_cost{}, wait_cost_per_entity{}, wake_up{},
      delivery_delay{};  ///< >= 0.
  friend bool operator==(const GraphPlatform&, const GraphPlatform&) = default;
};

/// A cost of the platform as files and options know it.
struct PlatformCost {
  std::string_view key;  ///< In microseconds.
  Duration GraphPlatform::*value;
  std::string_view meaning;
};
inline constexpr std::array kPlatformCosts = {
    PlatformCost{"release_cost_us", &GraphPlatform::release_cost, "Cost of releasing a timer (delta)"},
    PlatformCost{"pass_cost_us", &GraphPlatform::pass_cost, "Cost of a pass of the releaser (k)"},
    PlatformCost{"dispatch_cost_us", &GraphPlatform::dispatch_cost,
                 "Delay from a scheduling decision to the start of the job"},
    PlatformCost{"wait_cost_us", &GraphPlatform::wait_cost, "Cost of a wait of a wait-set executor"},
    PlatformCost{"wait_cost_per_entity_us", &GraphPlatform::wait_cost_per_entity,
                 "Cost of a wait per entity; a node has 8 besides its callbacks"},
    PlatformCost{"wake_up_us", &GraphPlatform::wake_up, "Delay until a woken thread competes for a core"},
    PlatformCost{"delivery_delay_us", &GraphPlatform::delivery_delay,
                 "Delay from publication to arrival of a sample"},
};

struct Input {
  std::string topic;
  std::uint32_t depth = 1;               ///< History depth; upstream: 1, command nodes 10.
  std::optional<std::int64_t> priority;  ///< Given fixed priority of this subscription.
  friend bool operator==(const Input&, const Input&) = default;
};

struct Node {
  std::string name;
  NodeType type = NodeType::sensor;
  Duration period{};              ///< sensor, cyclic: > 0.
  std::optional<Duration> phase;  ///< First timestamp relative to the epoch; taken with `--phases given`.
  Duration deadline{};            ///< sensor, cyclic: relative; the period unless given.
  std::optional<std::int64_t> priority;  ///< sensor, cyclic: given fixed priority of the timer.
  std::vector<Input> inputs;
  /// intersection: one for each input; command: none; callbacks: each topic that it publishes, once; else
  /// one.
  std::vector<std::string> outputs;
  Duration execution_time{};                                ///< Work of one activation (worst case).
  Duration best_case_execution_time{};                      ///< Equal to execution_time unless given.
  CallbackGroup group = CallbackGroup::mutually_exclusive;  ///< Of all that the node has; not for callbacks.
  // Of type `callbacks`, which has none of the above but name, type, inputs and outputs.
  std::vector<CallbackGroup> groups;
  std::vector<std::string> group_names;  ///< callbacks: parallel to groups.
  std::vector<Callback> callbacks;       ///< In order of creation.
  friend bool operator==(const Node&, const Node&) = default;
};

/// What a node of any type does, in order of creation: the six types of the reference system in terms of the
/// seventh. First their subscriptions in input order, then their timer.
std::vector<Callback> callbacks_of(const Node& node);

/// A path of data whose latency is measured, from sources to the sink.
/// Where a node has several callbacks that matter to it, the chain names their tasks instead.
struct Chain {
  std::string name;
  std::vector<std::string> nodes;    ///< In creation order; all nodes the path visits.
  std::vector<std::string> sources;  ///< Those of `nodes` where data begins: one timer, or a task.
  std::string sink;
  friend bool operator==(const Chain&, const Chain&) = default;
};

/// A node graph as its YAML file describes it; nodes in creation order.
struct Graph {
  std::string name;
  std::string description;
  std::vector<Node> nodes;
  std::vector<Chain> chains;
  WorkMode work = WorkMode::fixed;
  GraphPlatform platform;

  /// The node of that name, or of the task of that name; nullptr for an unknown name.
  [[nodiscard]] const Node* find(const std::string& node_or_task) const;
  /// Whether any node is of type `callbacks`. Messages of the others go by upstream's limits.
  [[nodiscard]] bool has_callbacks() const;
  friend bool operator==(const Graph&, const Graph&) = default;
};

/// Where a task of a graph's task set comes from.
struct TaskOrigin {
  std::uint32_t node = 0;
  std::optional<std::uint32_t> input;  ///< Index into the node's inputs; none: a timer.
  std::uint32_t callback = 0;          ///< Position among the node's callbacks.
};

/// The tasks of a graph: for each node in creation order its callbacks; no callback group has tasks of two
/// nodes. A task's `feeds` are the subscriptions of all topics that its jobs may publish to: both inputs of a
/// fusion feed its output, a cyclic node's subscriptions feed nothing, its timer feeds its output, each
/// connection of an intersection feeds its own output.
struct GraphTasks {
  TaskSet set;
  // Parallel to set.tasks:
  std::vector<TaskOrigin> origin;
  std::vector<Callback> callbacks;
  std::vector<std::vector<std::vector<TaskId>>> readers;  ///< Of each publication: its part of `feeds`.

  /// The subscriptions whose samples go into messages of a task.
  [[nodiscard]] std::vector<TaskId> merged_inputs(TaskId id) const;
  /// The tasks that a task's data reaches next: those it feeds, and those of its node whose messages its
  /// samples go into.
  [[nodiscard]] std::vector<TaskId> downstream(TaskId id) const;
};
[[nodiscard]] GraphTasks make_tasks(const Graph& graph);

/// Jobs of each task that really work, per second, in the steady state: a timer's own rate, a subscription's
/// that of its input; where jobs wait for sets, the rate of the set's slowest input (shared evenly over the
/// callbacks of which any may complete it). Tasks that never work count their input's rate.
std::vector<double> activation_rates(const GraphTasks& tasks);

/// Work of all nodes in percent of one core, from rates and execution times.
double load_percent(const Graph& graph);

/// Scales all execution times so that load_percent() becomes `percent` (>= 0; 0: no work at all).
/// Throws std::invalid_argument for a negative load, or when the graph has no work to scale.
void scale_to_load(Graph& graph, double percent);

}  // namespace hotpath
