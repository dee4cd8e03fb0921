// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The name of a node of ROS in a graph: `/perception/lidar` is perception.lidar. No node of ROS has a dot.
[[nodiscard]] std::string graph_node_name(const std::string& ros_name);
/// A topic without its leading slash. Here and there, what no name in a graph's file can have becomes `_`.
[[nodiscard]] std::string graph_topic_name(const std::string& ros_name);

/// The node of a graph that a node of ROS is, by its fully qualified name: the one with the name that an
/// imported graph gives it, or else with its bare name, if no other node of the graph has that in a
/// namespace. nullptr: none.
[[nodiscard]] const Node* find_ros_node(const Graph& graph, const std::string& ros_name);
/// What is to be said when no node of ROS, of at least one, is in the graph.
[[nodiscard]] std::string no_such_nodes(const Graph& graph, std::span<const std::string> ros_names);

}  // namespace hotpath
