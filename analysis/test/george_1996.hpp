// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Result of the demand test. `slack` is the smallest t - demand - blocking over the tested points,
/// at `t`; the test stops at the first point with negative slack.
struct DemandTest {
  bool schedulable = false;
  std::int64_t slack = 0;
  std::int64_t t = 0;
};

/// Theorem 2 of the paper (George, Rivierre, Spuri: "Preemptive and non-preemptive real-time
/// uniprocessor scheduling", INRIA RR-2966, 1996): non-preemptive EDF meets all deadlines if at
/// every absolute deadline t max{C_j : D_j > t} + sum of demand <= t. Also necessary for sporadic
/// tasks. The test points are the deadlines t = k T_i + D_i before the end of the synchronous busy
/// period (the printed "for all t > 0" fails for every set at t < max C); if D >= T throughout,
/// only those below D_max. No jitter. A utilisation above 1 gives `schedulable` false at t = 0.
DemandTest george_1996(const PeriodicTasks& tasks, TimeModel model = TimeModel::continuous);

}  // namespace hotpath
