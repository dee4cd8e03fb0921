// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/run_channel.hpp"
#include "live/live_run.hpp"

namespace hotpath::live {

/// What a repetition needs of a sourced ROS 2 workspace (AMENT_PREFIX_PATH); HOTPATH_ROS2_RUNNER overrides
/// its program. Throws UsageError for options that hotpath_rclcpp_runner does not support, and middlewares
/// for which ROS 2 has no package.
[[nodiscard]] RclcppPlan rclcpp_plan(const Options& options, const Plan& plan);

/// Rejects an executor that rclcpp lacks, in general or in the sourced ROS 2 (ROS_DISTRO), and a policy for
/// a timer thread that belongs to rclcpp. Throws UsageError; it lists the available executors.
void check_on_rclcpp(const setup::ExecutorSpec& executor, const Plan& plan);

/// Replaces the calling process by hotpath_rclcpp_runner, which talks to the coordinator like
/// run_process(). Returns only on failure, which it reports to the coordinator, with the exit code.
int become_rclcpp_runner(const Plan& plan, const RunMemory& memory, const Channel& coordinator);

}  // namespace hotpath::live
