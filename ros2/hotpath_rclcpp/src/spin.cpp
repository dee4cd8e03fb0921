// SPDX-License-Identifier: Apache-2.0
// The preloaded library libhotpath_rclcpp_spin.so: rclcpp::spin(node) of an existing program runs a
// PriorityExecutor. As rclcpp::spin() itself, both functions make an executor that nobody else sees.
// HOTPATH_EXECUTOR names a file of options; without it, the options have their defaults.
#include <cstdlib>
#include <rclcpp/rclcpp.hpp>

#include "hotpath_rclcpp/priority_executor.hpp"

namespace rclcpp {

void spin(node_interfaces::NodeBaseInterface::SharedPtr node) {
  const char* const file = std::getenv("HOTPATH_EXECUTOR");
  hotpath::PriorityExecutorOptions options;
  if (file != nullptr && *file != '\0') options = hotpath::PriorityExecutorOptions::from_file(file);
  ExecutorOptions of_rclcpp;
  of_rclcpp.context = node->get_context();
  hotpath::PriorityExecutor executor(options, of_rclcpp);
  executor.add_node(node);
  executor.spin();
  executor.remove_node(node);
}

void spin(Node::SharedPtr node) { spin(node->get_node_base_interface()); }

}  // namespace rclcpp
