// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// Bounds under one default executor (Teper, Betz, Guenzel, Ebner, von der Brueggen, Betz, Chen:
/// "End-to-end timing analysis and optimization of multi-executor ROS 2 systems", RTAS 2024),
/// without DDS latencies; in ns.

/// The bounds of the paper's comparison, for timers only: L_i = W + max(0, T_i - C_i + H_i) + C_i
/// (Equations 15 and 17) of every task. The end-to-end latency is the sum over the chain.
std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks);

}  // namespace hotpath
