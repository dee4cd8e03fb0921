// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/reference_system/run_channel.hpp"
#include "live/repetition_runner.hpp"

namespace hotpath::live {

/// The path of hotpath_rclcpp_runner: HOTPATH_ROS2_RUNNER, else the program of a
/// sourced ROS 2 workspace (AMENT_PREFIX_PATH). Throws UsageError with a remedy.
[[nodiscard]] std::string find_rclcpp_runner();

/// Rejects an executor that rclcpp lacks, in general or in the sourced ROS 2 (ROS_DISTRO), and a policy for
/// a timer thread that belongs to rclcpp. Throws UsageError; it lists the available executors.
void check_on_rclcpp(const setup::ExecutorSpec& executor, const Plan& plan);

/// Rejects a middleware for which the sourced ROS 2 has no package rmw_NAME_cpp. Throws UsageError.
void check_middleware(const std::string& name);

/// Replaces the calling process by hotpath_rclcpp_runner, which talks to the coordinator like
/// run_process(). Returns only on failure, which it reports to the coordinator, with the exit code.
int become_rclcpp_runner(const Plan& plan, const RunMemory& memory, const Channel& coordinator);

}  // namespace hotpath::live
