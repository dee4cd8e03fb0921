// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Exact worst-case response times of sporadic tasks with release jitter and arbitrary deadlines
/// under non-preemptive fixed priorities, over the level-k busy window (Davis, Burns, Bril,
/// Lukkien: "Controller Area Network (CAN) schedulability analysis", Real-Time Systems 35(3), 2007;
/// George et al., INRIA RR-2966, 1996). A task has no bound if its level's utilisation is above 1,
/// or equal to 1 with blocking or jitter.
ResponseTimes davis_2007(const PeriodicTasks& tasks, TimeModel model = TimeModel::continuous);

}  // namespace hotpath
