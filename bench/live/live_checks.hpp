// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "live/live_run.hpp"

namespace hotpath::live {

// Rejection of runs that cannot succeed, before any process starts. `plan` is the plan of all
// repetitions. All throw UsageError.

/// Parses `0,2-3`, a value of --cpus, into a sorted list of processors without duplicates. Refuses a
/// processor that this process may not use.
std::vector<int> parse_cpus(const std::string& text);

/// parse_thread_policy() for an option.
ThreadPolicy parse_policy(const std::string& text);

/// Options that hotpath_rclcpp_runner does not support.
void check_rclcpp_options(const Options& options, const Plan& plan);

/// Options of a transport or of rclcpp that the run does not use, Fast DDS in a build without it, and more
/// processes than the transport or the graph allows.
void check_transport(const Options& options, const Plan& plan,
                     const std::vector<setup::ExecutorSpec>& executors);

/// A deployment that contradicts the options, or whose processors or policies this process may not
/// use. Also throws InputError, with the line of the executor.
void check_deployment(const Plan& plan, const setup::ExecutorSpec& executor);

}  // namespace hotpath::live
