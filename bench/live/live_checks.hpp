// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "live/live_run.hpp"

namespace hotpath {

// Rejection of runs that cannot succeed, before any process starts. `plan` is the plan of all
// repetitions. All throw UsageError.

/// Options that hotpath_rclcpp_runner does not support.
void check_rclcpp_options(const RunOptions& options, const RepetitionPlan& plan);

/// Options of a network or of rclcpp in a run that uses neither.
void check_network_options(const RunOptions& options, const RepetitionPlan& plan);

/// Whatever needs Fast DDS, in a build without it.
void check_fastdds_options(const RunOptions& options, const RepetitionPlan& plan,
                           const std::vector<ExecutorSpec>& executors);

/// A deployment that contradicts the options, or whose processors or policies this process may not
/// use. Also throws InputError, with the line of the executor.
void check_deployment(const RepetitionPlan& plan, const ExecutorSpec& executor);

}  // namespace hotpath
