// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The rule for the timers' first timestamps; option `--phases`.
enum class Phases : std::uint8_t {
  creation,  ///< Creation of the timer plus its period, with nodes created one after another, as in rclcpp.
  synchronous,  ///< All at the epoch.
  given,        ///< `phase_ms` of the graph file. (A file of phases is read with read_phases.)
  random,       ///< Uniform in [0, period).
};

constexpr auto enum_texts(Phases) {
  return texts_in_order<Phases>({"creation", "synchronous", "given", "random"});
}

/// The cost of creating a node: a constant, plus one per publisher and subscription. Fitted by
/// least squares to all rows of reference_system/ros2_reference/rclcpp_autoware_phases.csv: the
/// creation instants of Autoware's timers in seven runs of rclcpp 26 on Fast DDS. The root mean
/// square error is 3.7 ms, most of it from one row; BehaviorPlanner's timer is created 96 ms after
/// the first one.
inline constexpr Duration kNodeCreation = std::chrono::microseconds(1840);
inline constexpr Duration kEndpointCreation = std::chrono::microseconds(1320);

/// Creation instant of the timer of each task's node, relative to the creation of the graph's first
/// timer; a node's timer is created after its publishers and subscriptions. `step` replaces the two
/// constants by a uniform time per node (>= 0). Subscriptions: 0.
[[nodiscard]] std::vector<Duration> creation_instants(const Graph& graph, const GraphTasks& tasks,
                                                      std::optional<Duration> step = std::nullopt);

/// Parameters of make_phases().
struct PhaseOptions {
  std::optional<Duration> step;  ///< `creation`: uniform time per node instead of the constants above.
  std::uint64_t seed = 1;        ///< `random`: the same seed gives the same phases on every machine.
};

/// First timestamp of every timer relative to the epoch, >= 0, by task; 0 for subscriptions. Throws
/// std::invalid_argument for `given` if a timer's node has no phase.
[[nodiscard]] std::vector<Duration> make_phases(const Graph& graph, const GraphTasks& tasks, Phases phases,
                                                const PhaseOptions& options = {});

/// First timestamps from a CSV file, indexed by the tasks of make_tasks(graph). Three forms:
///  - `task,first_release_ms` or `task,created_ms`: one row for each timer;
///  - columns `executor` and `created_ms_NODE` for each timer: the row of that executor, where the row
///    `NAME (RULE)` counts as executor NAME unless another row is called just NAME;
///  - a golden trace (reference_system/ros2_reference/traces): its header.
/// A timer's first timestamp is its creation plus its period. Blank lines are skipped.
/// Throws InputError.
[[nodiscard]] std::vector<Duration> read_phases(const std::string& path, const Graph& graph,
                                                const std::string& executor);

/// The content of a file for read_phases(), in the form `task,first_release_ms`, to the nanosecond. `first`:
/// by task, not negative.
[[nodiscard]] std::string phases_csv(const TaskSet& set, const std::vector<Duration>& first);

}  // namespace hotpath
