// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
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

/// Runs all repetitions of all executors, interleaved in seeded random order, into one result
/// folder; prints the table and draws the figures. Throws UsageError, InputError, RunError.
void run_live(const Options& options);

}  // namespace hotpath::live
