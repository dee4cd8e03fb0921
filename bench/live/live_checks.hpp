// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "live/live_run.hpp"

namespace hotpath::live {

// Rejection of runs that cannot succeed, before any process starts. `plan` is the plan of all
// repetitions. All throw UsageError.

/// Options that hotpath_rclcpp_runner does not support.
void check_rclcpp_options(const Options& options, const Plan& plan);

/// Options of a network or of rclcpp in a run that uses neither.
void check_network_options(const Options& options, const Plan& plan);

/// Whatever needs Fast DDS, in a build without it.
void check_fastdds_options(const Options& options, const Plan& plan,
                           const std::vector<setup::ExecutorSpec>& executors);

/// A deployment that contradicts the options, or whose processors or policies this process may not
/// use. Also throws InputError, with the line of the executor.
void check_deployment(const Plan& plan, const setup::ExecutorSpec& executor);

}  // namespace hotpath::live
