// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Duerr, von der Brueggen, Chen, Chen: "End-to-end timing analysis of sporadic cause-effect chains
/// in distributed systems", CASES 2019. T is the longest time between two releases.

/// Theorem 5.4, maximum reaction time: T_1 + R_n + sum_{i<n} max(R_i, T_i+1 + x_i R_i).
std::int64_t duerr_2019_reaction_time(const PeriodicTasks& tasks, const ResponseTimes& bounds,
                                      const TaskChain& chain, Priorities priorities = Priorities::fixed);

}  // namespace hotpath
