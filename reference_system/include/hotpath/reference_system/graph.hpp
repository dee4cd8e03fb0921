// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath {

/// When a job publishes.
enum class PublishRule : std::uint8_t {
  always,   ///< Every job.
  all_new,  ///< When each input of a set has a sample that no such message has contained yet.
  every,    ///< Every n-th job.
  last_of,  ///< Every job; adds the newest sample of each input of a set that no message has contained yet.
};

/// A topic that a callback publishes, and when. The message contains the histories of the set's
/// samples and of the sample that the job itself took.
struct Publication {
  PublishRule rule = PublishRule::always;
  std::uint32_t n = 1;            ///< every: >= 1.
  std::uint32_t first = 0;        ///< every: the job with the first message, in [1, n]; 0: job n.
  double at = 1;                  ///< Share of the execution time before it, in [0, 1]; 1: at the end.
  std::vector<std::uint32_t> of;  ///< all_new, last_of: ascending indices into the node's inputs, >= 1.
  std::string topic;
  friend bool operator==(const Publication&, const Publication&) = default;
};

/// Whether two publications of callbacks of one node follow the same rule. If it is all_new, they
/// complete the same set, whose samples enter one message.
[[nodiscard]] bool same_rule(const Publication& a, const Publication& b);

/// A quantile of execution times.
struct DurationQuantile {
  double percent = 0;  ///< In [0, 100].
  Duration time{};     ///< >= 0.
  friend bool operator==(const DurationQuantile&, const DurationQuantile&) = default;
};

/// Two hundred values with these quantiles, linearly interpolated between them; the first and the
/// last are the extremes. `quantiles` are ascending, from 0 to 100 percent.
[[nodiscard]] std::vector<Duration> values_of(const std::vector<DurationQuantile>& quantiles);

/// What a graph states of a timer.
struct StatedTimer : TimerTimes {
  std::optional<Duration> phase;         ///< First timestamp relative to the epoch, for `--phases given`.
  std::optional<std::int64_t> priority;  ///< Given fixed priority; also of subscriptions.
  friend bool operator==(const StatedTimer&, const StatedTimer&) = default;
};

/// What a graph states of a callback's execution time.
struct StatedWork {
  Duration worst{}, best{};                               ///< 0 <= best <= worst.
  std::shared_ptr<const std::vector<Duration>> measured;  ///< Within [best, worst], >= 1; nullptr: none.
  std::string measured_file;  ///< Their file, relative to that of the graph; empty: in the graph.
  std::vector<DurationQuantile> quantiles;  ///< The source of `measured`; empty: none.
  /// Compares measured values, not where they are.
  friend bool operator==(const StatedWork& a, const StatedWork& b);
};

/// A timer or a subscription of a node; it becomes one task.
struct Callback : StatedTimer, StatedWork {
  std::string task;                              ///< Name of the task.
  std::optional<std::uint32_t> input;            ///< Index into the node's inputs; std::nullopt: a timer.
  std::uint32_t group = 0;                       ///< Index into the node's groups.
  std::vector<Publication> publishes;            ///< Each topic once.
  EntityKind entity = EntityKind::subscription;  ///< Subscriptions; others than these: Graph::service_wait.
  /// Only stores its samples for the messages of other callbacks: publishes nothing and ends no
  /// chain. Set by callbacks_of().
  bool stores_only = false;

  /// Whether each publication waits for a set: a job that completes none takes no time.
  [[nodiscard]] bool waits_for_sets() const;
  /// Whether it publishes before the end of its jobs.
  [[nodiscard]] bool publishes_early() const {
    return std::ranges::any_of(publishes, [](const Publication& p) { return p.at < 1; });
  }
  friend bool operator==(const Callback&, const Callback&) = default;
};

/// The six node types of the reference system (upstream's nodes/rclcpp/*.hpp), and a generic one.
enum class NodeType : std::uint8_t {
  sensor,        ///< Timer; publishes.
  transform,     ///< One input; works, publishes.
  fusion,        ///< Two inputs or more; works and publishes when it has a message of each.
  cyclic,        ///< Inputs are stored; its timer works and publishes every cycle.
  intersection,  ///< Independent transforms in one node: input i leads to output i.
  command,       ///< One input; the end of a chain.
  callbacks,     ///< Any timers and subscriptions, with any groups and publications.
};
constexpr auto enum_texts(NodeType) {
  return texts_in_order<NodeType>(
      {"sensor", "transform", "fusion", "cyclic", "intersection", "command", "callbacks"});
}

/// How a job spends its execution time.
enum class WorkMode : std::uint8_t {
  fixed,     ///< A fixed amount of work (upstream): preemption prolongs the job.
  wall,      ///< Until an instant of the clock (the paper's task sets): preemption counts as work.
  cpu_time,  ///< Until the thread has used that much CPU time: preemption prolongs the job, but a
             ///< slow processor does not.
};
constexpr auto enum_texts(WorkMode) { return texts_in_order<WorkMode>({"fixed", "wall", "cpu_time"}); }

/// OS priority of the timer management thread, compared with the executor thread's.
enum class TimerThread : std::uint8_t {
  by_executor,  ///< Raised only under the paper's executors, as in live runs.
  raised,
  equal,
};

/// The execution times of a simulation.
enum class ExecutionTimeModel : std::uint8_t {
  worst,     ///< Always the worst case.
  uniform,   ///< Uniform between best and worst case.
  measured,  ///< Drawn from measured values; uniform for callbacks without any.
  replayed,  ///< Measured values in the measured order, from a place that the seed determines.
};

constexpr auto enum_texts(TimerThread) {
  return texts_in_order<TimerThread>({"by_executor", "raised", "equal"});
}
constexpr auto enum_texts(ExecutionTimeModel) {
  return texts_in_order<ExecutionTimeModel>({"worst", "uniform", "measured", "replayed"});
}

/// Deliveries of a recording. Simulations have only `delivery_delay`.
struct MeasuredDelivery {
  Duration longest{}, median{};  ///< 0: none was measured.
  std::uint32_t samples = 0;     ///< 0: unknown.
  friend bool operator==(const MeasuredDelivery&, const MeasuredDelivery&) = default;
};

/// The machine on which `hotpath simulate` runs a graph by default; cores in [1, kMaxWorkers], costs >= 0.
/// What the graph does not state has its default here; make_platform() adds it.
struct GraphPlatform : Platform {
  TimerThread timer_thread = TimerThread::by_executor;
  ExecutionTimeModel execution_times = ExecutionTimeModel::worst;
  MeasuredDelivery measured_delivery;

  /// The longest delivery that bounds cover.
  [[nodiscard]] Duration longest_delivery() const {
    return delivery_delay > Duration{} ? delivery_delay : measured_delivery.longest;
  }
  friend bool operator==(const GraphPlatform&, const GraphPlatform&) = default;
};

/// A cost of the platform, as named in files and options. Of a cost that depends on the kind of the
/// callback, one key states both kinds, and one key each kind alone.
struct PlatformCost {
  std::string_view key;  ///< Name of the option or key; the value is in microseconds.
  Duration Platform::*value;
  std::string_view meaning;
  Duration Platform::*other_kind = nullptr;
  bool both_kinds = false;

  /// std::nullopt: other keys state it.
  [[nodiscard]] std::optional<Duration> in(const Platform& platform) const {
    const bool stated = other_kind == nullptr || (platform.*value == platform.*other_kind) == both_kinds;
    return stated ? std::optional(platform.*value) : std::nullopt;
  }
  /// A key of one kind must follow the key of both.
  void set(Platform& platform, Duration cost) const {
    platform.*value = cost;
    if (both_kinds) platform.*other_kind = cost;
  }
};
inline constexpr std::array kPlatformCosts = {
    PlatformCost{"release_cost_us", &Platform::release_cost, "Cost of releasing a timer (delta)"},
    PlatformCost{"pass_cost_us", &Platform::pass_cost, "Cost of a pass of the releaser (k)"},
    PlatformCost{"dispatch_cost_us", &Platform::timer_dispatch_cost,
                 "Delay from a scheduling decision to the start of the job",
                 &Platform::subscription_dispatch_cost, true},
    PlatformCost{"timer_dispatch_cost_us", &Platform::timer_dispatch_cost, "The same for jobs of timers",
                 &Platform::subscription_dispatch_cost},
    PlatformCost{"subscription_dispatch_cost_us", &Platform::subscription_dispatch_cost,
                 "The same for jobs of subscriptions", &Platform::timer_dispatch_cost},
    PlatformCost{"wait_cost_us", &Platform::wait_cost, "Cost of a wait of a wait-set executor"},
    PlatformCost{"wait_cost_per_entity_us", &Platform::wait_cost_per_entity,
                 "Cost of a wait per entity; a node has 8 besides its callbacks"},
    PlatformCost{"wake_up_us", &Platform::wake_up_latency, "Delay until a woken thread competes for a core"},
    PlatformCost{"delivery_delay_us", &Platform::delivery_delay,
                 "Delay from publication to arrival of a sample"},
};
static_assert(std::ranges::all_of(kAllCosts, [](auto cost) {
  return std::ranges::count(kPlatformCosts, cost, &PlatformCost::value) > 0;
}));

/// A topic to which a node subscribes.
struct Input {
  std::string topic;
  std::uint32_t depth = 1;  ///< History depth, >= 1.
  friend bool operator==(const Input&, const Input&) = default;
};

/// A node of a graph: its callbacks, whatever its type. Files have short forms for the six types of the
/// reference system (ReferenceNode).
struct Node {
  std::string name;
  NodeType type = NodeType::callbacks;  ///< How files write it and pictures show it.
  std::vector<Input> inputs;
  std::vector<std::string> outputs;  ///< Each topic that its callbacks publish, once.
  std::vector<CallbackGroup> groups;
  std::vector<std::string> group_names;  ///< Of the first `groups`; the last group may have no name.
  std::vector<Callback> callbacks;       ///< In order of creation.
  friend bool operator==(const Node&, const Node&) = default;
};

/// The callbacks of a node, with Callback::stores_only.
std::vector<Callback> callbacks_of(const Node& node);

/// A path of data from sources to a sink, whose latency is measured. If a node has several relevant
/// callbacks, the chain names their tasks instead of the node.
struct Chain {
  std::string name;
  std::vector<std::string> nodes;  ///< In creation order; all nodes the path visits.
  /// The members of `nodes` where data begins: nodes with one timer, or tasks.
  std::vector<std::string> sources;
  std::string sink;
  friend bool operator==(const Chain&, const Chain&) = default;
};

/// The order in which samples of a topic reach its subscribers, if it is not their order of creation.
struct DeliveryOrder {
  /// The subscribing nodes, each once, the first one reached first; empty: the order is unknown, and runs
  /// use the order of creation.
  std::vector<std::string> nodes;
  [[nodiscard]] bool unknown() const { return nodes.empty(); }
  friend bool operator==(const DeliveryOrder&, const DeliveryOrder&) = default;
};

/// A node graph, as described by its YAML file; nodes in creation order.
struct Graph {
  std::string name;
  std::string description;
  std::vector<Node> nodes;
  std::vector<Chain> chains;
  WorkMode work = WorkMode::cpu_time;
  GraphPlatform platform;
  /// How long a request or response of a service or an action waits before it runs next under the paper's
  /// executors (SchedulerOptions::service_wait); 0: without limit.
  Duration service_wait{};
  RosDistro release = RosDistro::jazzy;  ///< Whose rules `default` follows (SchedulerOptions::release).
  std::map<std::string, DeliveryOrder> delivery;  ///< By topic; absent: the order of creation.
  std::set<std::string> intra_process;            ///< Topics whose subscriptions are waitables.

  /// The node with this name, or the node of the task with this name; nullptr for an unknown name.
  [[nodiscard]] const Node* find(const std::string& node_or_task) const;
  [[nodiscard]] std::vector<std::string> node_names() const;
  /// Whether any node is of type `callbacks`. Messages of other graphs have upstream's limits.
  [[nodiscard]] bool has_callbacks() const;
  friend bool operator==(const Graph&, const Graph&) = default;
};

/// The origin of a task in the graph.
struct TaskOrigin {
  std::uint32_t node = 0;
  std::optional<std::uint32_t> input;  ///< Index into the node's inputs; std::nullopt: a timer.
  std::uint32_t callback = 0;          ///< Position among the node's callbacks.
};

/// The tasks of a graph: the callbacks of each node in creation order; no callback group spans two
/// nodes. A task's `feeds` are the subscriptions of all topics to which its jobs may publish: both
/// inputs of a fusion feed its output; a cyclic node's subscriptions feed nothing, and its timer
/// feeds its output; each connection of an intersection feeds its own output. The subscriptions of a
/// topic are in the order in which its samples reach them.
struct GraphTasks {
  TaskSet set;
  // Parallel to set.tasks:
  std::vector<TaskOrigin> origin;
  std::vector<Callback> callbacks;
  std::vector<std::vector<std::vector<TaskId>>> readers;  ///< By publication: its part of `feeds`.

  /// The subscriptions whose samples enter the messages of a task.
  [[nodiscard]] std::vector<TaskId> merged_inputs(TaskId id) const;
  /// The next tasks that a task's data reaches: the tasks that it feeds, and tasks of its node
  /// whose messages contain its samples.
  [[nodiscard]] std::vector<TaskId> downstream(TaskId id) const;
  /// Subscriptions that activate each other for ever, each before one that it feeds; empty: there are none.
  [[nodiscard]] std::vector<TaskId> cycle() const;
  /// All subscriptions in an order of creation such that each topic's are in the order of its delivery
  /// and, where that allows it, each node's in the order of the graph.
  [[nodiscard]] std::vector<TaskId> subscriptions_to_create() const;
};

/// These tasks, then those to which `next`, the tasks that follow a task, leads: the nearest first.
[[nodiscard]] std::vector<TaskId> reached_from(std::vector<TaskId> tasks, const auto& next) {
  for (std::size_t i = 0; i < tasks.size(); ++i)
    for (const TaskId id : next(tasks[i]))
      if (std::ranges::count(tasks, id) == 0) tasks.push_back(id);
  return tasks;
}

/// What `from` leads to along the edges `next`, each after all that follow it, found by depth-first search.
/// Removes the edges that close cycles.
[[nodiscard]] std::vector<std::uint32_t> cut_cycles(std::vector<std::vector<std::uint32_t>>& next,
                                                    const std::vector<std::uint32_t>& from);

/// The nodes that subscribe to a topic, in the order of creation.
[[nodiscard]] std::vector<std::string> subscribers_of(const Graph& graph, const std::string& topic);
/// The topics of several subscribers whose order of delivery is unknown.
[[nodiscard]] std::vector<std::string> unknown_deliveries(const Graph& graph);
/// The graph with a random order of delivery, equally likely, wherever it is unknown.
[[nodiscard]] Graph with_drawn_deliveries(Graph graph, std::uint64_t seed);

/// Expands a valid graph into its tasks.
[[nodiscard]] GraphTasks make_tasks(const Graph& graph);
/// Gives the tasks of the graph its order of delivery.
void set_delivery(const Graph& graph, GraphTasks& tasks);

/// Steady-state rate of working jobs of each task, per second: for a timer its own rate, for a
/// subscription the rate of its input. If jobs wait for sets, it is the rate of the set's slowest
/// input, shared evenly over the callbacks that may complete it. Tasks that never work have the
/// rate of their input.
std::vector<double> activation_rates(const GraphTasks& tasks);

/// Work of all nodes in percent of one core, from rates and execution times.
double load_percent(const Graph& graph);

/// Scales all execution times so that load_percent() becomes `percent` (>= 0; 0: no work). Throws
/// std::invalid_argument for a negative load, or if the graph has no work to scale.
void scale_to_load(Graph& graph, double percent);

/// Divides all periods, deadlines and given phases by `percent` / 100 (> 0), whole nanoseconds >= 1.
void scale_rates(Graph& graph, double percent);

/// Replicates all nodes and chains `copies` (>= 1) times, without connections between the copies.
/// From the second copy on, names and topics of the n-th copy end in `_n`. Throws
/// std::invalid_argument if a name becomes too long.
void make_copies(Graph& graph, unsigned copies);

/// The physical lower limit of the age of a chain's data: its computation, from the start of a source to the
/// finish of the sink, if nothing else runs. For Autoware's hot path: 5 and 6 crunches.
struct ChainLimits {
  Duration one_core_per_branch{};  ///< Work of the nodes on the longest branch.
  Duration one_thread{};           ///< Work of all nodes.
};
/// The limits of a chain of a valid graph.
ChainLimits chain_limits(const Graph& graph, const Chain& chain);

/// Derives chains for a graph without chains: from timers to tasks whose data reaches no other
/// task, also through cyclic nodes. Returns one chain per pair, along the path with the most tasks,
/// and among these with the most work; at most `most` chains, sorted by number of tasks and then by
/// work, largest first. They are called chain_1, chain_2 and so on. A cycle through timers is cut
/// where a search from the timer closes it.
[[nodiscard]] std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most);

}  // namespace hotpath
