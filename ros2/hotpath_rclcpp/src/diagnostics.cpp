// SPDX-License-Identifier: Apache-2.0
// hotpath_diagnostics: `hotpath watch --json -- ... | ros2 run hotpath_rclcpp hotpath_diagnostics`
#include <unistd.h>

#include <cstdlib>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <iostream>
#include <rclcpp/rclcpp.hpp>

#include "watch_relay.hpp"

namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using hotpath::WatchStatus;

constexpr const char* kUse =
    "use: hotpath watch --json -- COMMAND... | ros2 run hotpath_rclcpp hotpath_diagnostics\n"
    "Publishes what the watcher reports on /diagnostics. Arguments are those of ROS only (--ros-args).\n";

DiagnosticArray to_message(const std::vector<WatchStatus>& statuses, const rclcpp::Time& now) {
  DiagnosticArray message;
  message.header.stamp = now;
  for (const WatchStatus& from : statuses) {
    auto& status = message.status.emplace_back();
    status.level = static_cast<unsigned char>(from.level);
    status.name = from.name;
    status.message = from.message;
    for (const auto& [key, value] : from.values) {
      status.values.emplace_back();
      status.values.back().key = key;
      status.values.back().value = value;
    }
  }
  return message;
}

/// Publishes until the watcher or this node ends. Throws NoReport.
void run() {
  const auto node = std::make_shared<rclcpp::Node>("hotpath_diagnostics");
  const auto publisher = node->create_publisher<DiagnosticArray>("/diagnostics", rclcpp::QoS(10));
  hotpath::relay_watch(
      STDIN_FILENO, [] { return rclcpp::ok(); },
      [&](const std::vector<WatchStatus>& statuses) {
        publisher->publish(to_message(statuses, node->get_clock()->now()));
      });
  if (rclcpp::ok()) publisher->wait_for_all_acked(std::chrono::seconds(1));
}

}  // namespace

int main(int argc, char** argv) {
  int code = EXIT_SUCCESS;
  try {
    if (rclcpp::remove_ros_arguments(argc, argv).size() > 1) {
      std::cerr << kUse;
      return 2;
    }
    rclcpp::init(argc, argv);
    run();
  } catch (const hotpath::NoReport& error) {
    std::cerr << "hotpath_diagnostics: " << error.what() << '\n' << kUse;
    code = EXIT_FAILURE;
  } catch (const std::exception& error) {
    std::cerr << "hotpath_diagnostics: " << error.what() << '\n';
    code = rclcpp::ok() ? EXIT_FAILURE : EXIT_SUCCESS;  // a signal ends the context at any time
  }
  rclcpp::shutdown();
  return code;
}
