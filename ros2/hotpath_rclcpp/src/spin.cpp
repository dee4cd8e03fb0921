// SPDX-License-Identifier: Apache-2.0
// The preloaded library libhotpath_rclcpp_spin.so: rclcpp::spin(node) of an existing program runs a
// PriorityExecutor. As rclcpp::spin() itself, both functions make an executor that nobody else sees.
// HOTPATH_EXECUTOR names a file of options; without it, the options have their defaults.
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <rclcpp/rclcpp.hpp>

#include "hotpath_rclcpp/priority_executor.hpp"

namespace rclcpp {

void spin(node_interfaces::NodeBaseInterface::SharedPtr node) {
  const char* const file = std::getenv("HOTPATH_EXECUTOR");
  hotpath::PriorityExecutorOptions options;
  ExecutorOptions of_rclcpp;
  of_rclcpp.context = node->get_context();
  std::optional<hotpath::PriorityExecutor> executor;
  try {
    if (file != nullptr && *file != '\0') options = hotpath::PriorityExecutorOptions::from_file(file);
    executor.emplace(options, of_rclcpp);
  } catch (const std::exception& error) {  // which the program does not expect
    RCLCPP_FATAL(get_logger("hotpath_rclcpp"), "HOTPATH_EXECUTOR: %s", error.what());
    std::fflush(nullptr);
    std::_Exit(2);  // of wrong use; threads of the middleware run
  }
  executor->add_node(node);
  executor->spin();
  executor->remove_node(node);
}

void spin(Node::SharedPtr node) { spin(node->get_node_base_interface()); }

}  // namespace rclcpp
