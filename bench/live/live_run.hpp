// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "live/repetition_runner.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::live {

/// The command line of `run`.
struct Options : setup::CommonOptions {
  double time_out_s = 20;  ///< For set-up, and for answers after the end of a repetition.
  Plan plan;               ///< Common to all repetitions.
  std::vector<setup::Stack> stacks = {setup::Stack::native};
  std::vector<std::string> rmw;  ///< Middlewares of rclcpp; empty: the default of ROS 2.
  bool live = false, quick = false;
};

/// Parses `0,2-3`, a value of --cpus, into a sorted list of processors without duplicates. Throws UsageError
/// for a processor that this process may not use.
std::vector<int> parse_cpus(const std::string& text);

/// parse_thread_policy() for an option. Throws UsageError.
ThreadPolicy parse_policy(const std::string& text);

/// Throws UsageError with the first sentence that applies.
void refuse_any(const std::vector<std::pair<bool, std::string>>& sentences);

/// Rejects a run that cannot succeed. `plan` is that of all repetitions. Throws UsageError, and InputError
/// with the line of a deployment's executor.
void check_run(const Options& options, const Plan& plan, const std::vector<setup::ExecutorSpec>& executors);

/// Runs all repetitions of all executors, interleaved in seeded random order, into one result
/// folder; prints the table and draws the figures. Throws UsageError, InputError, RunError.
void run_live(const Options& options);

}  // namespace hotpath::live
