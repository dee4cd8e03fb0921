// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

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

}  // namespace hotpath
