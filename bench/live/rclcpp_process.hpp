// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/reference_system/run_channel.hpp"
#include "live/repetition_runner.hpp"

namespace hotpath {

/// The program hotpath_rclcpp_runner: what `given` or HOTPATH_ROS2_RUNNER says, else of the ROS 2 workspaces
/// that are sourced (AMENT_PREFIX_PATH). Throws UsageError that says what to do.
[[nodiscard]] std::string find_rclcpp_runner(const std::string& given);

/// Refuses an executor that rclcpp does not have, at all or in the ROS 2 that is sourced (ROS_DISTRO). Throws
/// UsageError with those that there are.
void check_on_rclcpp(const ExecutorSpec& executor);

/// The calling process becomes the one that runs the repetition on rclcpp; it talks to the coordinator as
/// run_process() does. Returns, the exit code, only when that fails, which the coordinator is told.
int become_rclcpp_runner(const RepetitionPlan& plan, const RunMemory& memory, const Channel& coordinator);

}  // namespace hotpath
