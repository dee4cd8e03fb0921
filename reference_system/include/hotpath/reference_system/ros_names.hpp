// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The graph's name for a ROS node: `/perception/lidar` becomes perception.lidar. ROS node names
/// have no dots.
[[nodiscard]] std::string graph_node_name(const std::string& ros_name);
/// A topic without its leading slash. In both functions, characters that are invalid in names of
/// graph files become `_`.
[[nodiscard]] std::string graph_topic_name(const std::string& ros_name);

/// The graph's node for a ROS node, by its fully qualified name: the node with the name that an
/// imported graph gives it, or else with its bare name, if no other node of the graph has that name
/// in a namespace. nullptr if there is none.
[[nodiscard]] const Node* find_ros_node(const Graph& graph, const std::string& ros_name);
/// The message for the case that none of the ROS nodes (at least one) is in the graph.
[[nodiscard]] std::string no_such_nodes(const Graph& graph, std::span<const std::string> ros_names);

/// A callback's priority from a file.
struct GivenPriority {
  std::string id;             ///< `/NODE@Timer(NANOSECONDS)`, `/NODE@Subscription(/TOPIC)`, ...
  std::int64_t priority = 0;  ///< Smaller first.
  int line = 0;
};

/// Reads `priorities: [{id: ID, priority: N}]`, YAML. An id is the id of a callback group in the
/// configuration of Autoware's CallbackIsolatedExecutor; an id of several callbacks
/// (`/NODE@Subscription(/A)@Timer(N)`) becomes one item per callback. Throws InputError.
[[nodiscard]] std::vector<GivenPriority> read_priorities(const std::string& path);

/// The message for an unknown id: `FILE:LINE: ...` with the nearest known id.
[[nodiscard]] std::string no_such_callback(const std::string& path, const GivenPriority& given,
                                           std::span<const std::string> known);

}  // namespace hotpath
