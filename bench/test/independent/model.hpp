// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

/// A second description of graphs and executors, written from docs/, the paper and rclcpp's sources
/// alone: it shares no code with hotpath and must stay so, since its only purpose is to disagree.
namespace independent {

using Nanoseconds = std::int64_t;

/// When a callback publishes (docs/graphs.md, "Rules of publication").
enum class Rule { always, every, all_new, last_of };

struct Publication {
  std::string topic;
  Rule rule = Rule::always;
  std::int64_t every = 1;
  int slots = -1;              ///< For all_new and last_of: index into Graph::slots.
  std::vector<int> readers{};  ///< Subscriptions of the topic, in the order of creation.
};

/// A timer or one subscription of a node.
struct Task {
  std::string name, node;
  bool timer = false;
  bool node_in_chains = true;  ///< Chains name the node instead of the task.
  int group = 0;               ///< Callback group, unique in the graph.
  Nanoseconds period = 0, phase = 0, deadline = 0;
  std::optional<std::int64_t> priority{};
  std::size_t depth = 1;
  std::string kind = "subscription";  ///< Or timer, service, client, waitable.
  bool intra_process = false;         ///< A waitable that may be asked only when its turn comes.
  bool guaranteed = false;            ///< See Graph::service_wait.
  Nanoseconds best = 0, worst = 0;    ///< Execution times.
  std::vector<Publication> publications{};
  std::vector<std::pair<int, int>> stores{};  ///< Slots that keep its newest sample: set, position.
  std::vector<int> sources{};                 ///< Indices among the sources of all chains.
};

struct Chain {
  std::string name;
  std::vector<int> sources;   ///< As Task::sources.
  std::vector<bool> is_sink;  ///< By task.
};

struct Graph {
  std::vector<Task> tasks;
  std::vector<std::size_t> slots;  ///< Sets of slots of fusions and cyclic nodes: number of inputs.
  std::vector<Chain> chains;
  /// By source: pairs of tasks between which its data counts (docs/results.md, "Source jobs").
  std::vector<std::set<std::pair<int, int>>> ways;
  int groups = 0;
  std::set<int> reentrant{};     ///< Of these.
  Nanoseconds service_wait = 0;  ///< 0: services wait like all others.
  bool until_iron = false;       ///< `default` asks waitables when a wait ends.
};

constexpr std::size_t kMostSources = 16;

/// What a message contains of one source: the oldest timestamp and the latest start of its jobs.
struct Mark {
  Nanoseconds oldest = std::numeric_limits<Nanoseconds>::max();
  Nanoseconds latest_start = std::numeric_limits<Nanoseconds>::min();
  int jobs = 0;  ///< 2 stands for any larger number.
};
using History = std::array<Mark, kMostSources>;

/// Reads a graph file. Throws YAML::Exception or std::runtime_error for what it does not know.
Graph read_graph(const std::string& file);

/// Tasks to which a job's data passes on directly: readers of its messages, and callbacks whose
/// messages include its sample. `activations_only`: those that it activates.
std::vector<int> successors(const Graph& graph, int task, bool activations_only);

}  // namespace independent
