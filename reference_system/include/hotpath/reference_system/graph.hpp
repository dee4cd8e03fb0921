// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The six node types of the reference system (upstream's nodes/rclcpp/*.hpp).
enum class NodeType : std::uint8_t {
  sensor,        ///< Timer; publishes.
  transform,     ///< One input; works, publishes.
  fusion,        ///< Two inputs or more; works and publishes when it has a message of each.
  cyclic,        ///< Inputs are stored; its timer works and publishes every cycle.
  intersection,  ///< Independent transforms under one name: input i leads to output i.
  command,       ///< One input; the end of a chain.
};
const char* to_string(NodeType);  ///< As in graph files.

/// How a job burns its execution time.
enum class WorkMode : std::uint8_t {
  fixed,     ///< A fixed amount of work (upstream): preemption makes a job longer, not its work smaller.
  wall,      ///< Until an instant of the clock (the paper's task sets): preemption counts as work.
  cpu_time,  ///< Until the thread has used that much CPU time.
};

struct Input {
  std::string topic;
  std::uint32_t depth = 1;               ///< History depth; upstream: 1, command nodes 10.
  std::optional<std::int64_t> priority;  ///< Given fixed priority of this subscription.
};

struct Node {
  std::string name;
  NodeType type = NodeType::sensor;
  Duration period{};              ///< sensor, cyclic: > 0.
  std::optional<Duration> phase;  ///< First timestamp relative to the epoch; taken with `--phases given`.
  Duration deadline{};            ///< sensor, cyclic: relative; the period unless given.
  std::optional<std::int64_t> priority;  ///< sensor, cyclic: given fixed priority of the timer.
  std::vector<Input> inputs;
  std::vector<std::string> outputs;  ///< intersection: one for each input; command: none; else one at most.
  Duration execution_time{};         ///< Work of one activation (worst case).
  Duration best_case_execution_time{};  ///< Equal to execution_time unless given.
  CallbackGroup group = CallbackGroup::mutually_exclusive;
};

/// A path of data whose latency is measured, from sources to the sink.
struct Chain {
  std::string name;
  std::vector<std::string> nodes;    ///< In creation order; all nodes the path visits.
  std::vector<std::string> sources;  ///< Those of `nodes` where data begins.
  std::string sink;
};

/// A node graph as its YAML file describes it; nodes in creation order.
struct Graph {
  std::string name;
  std::string description;
  std::vector<Node> nodes;
  std::vector<Chain> chains;
  WorkMode work = WorkMode::fixed;

  /// nullptr for an unknown name.
  const Node* find(const std::string& node) const;
};

/// Where a task of a graph's task set comes from.
struct TaskOrigin {
  std::uint32_t node = 0;
  std::optional<std::uint32_t> input;  ///< Index into the node's inputs; none: the node's timer.
};

/// The tasks of a graph: for each node in creation order its subscriptions in input order, then its timer;
/// every node is a callback group of its own. A task's `feeds` are the subscriptions of the topic that its
/// jobs publish to: both inputs of a fusion feed its output, a cyclic node's subscriptions feed nothing, its
/// timer feeds its output, each connection of an intersection feeds its own output.
struct GraphTasks {
  TaskSet set;
  std::vector<TaskOrigin> origin;  ///< Parallel to set.tasks.
};
GraphTasks make_tasks(const Graph& graph);

/// Jobs of each task that really work, per second, in the steady state: a timer's own rate, a transform's,
/// command's or intersection's that of its input, a fusion's slowest input's (shared evenly over its inputs,
/// of which only one completes a set); subscriptions of cyclic nodes never work and count their input's rate.
std::vector<double> activation_rates(const Graph& graph, const GraphTasks& tasks);

/// Work of all nodes in percent of one core, from rates and execution times.
double load_percent(const Graph& graph);

/// Scales all execution times so that load_percent() becomes `percent` (>= 0; 0: no work at all).
/// Throws std::invalid_argument for a negative load, or when the graph has no work to scale.
void scale_to_load(Graph& graph, double percent);

}  // namespace hotpath
