// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>

#include "task_sets.hpp"

namespace hotpath {

/// Theorem 2 of the paper (George, Rivierre, Spuri: "Preemptive and non-preemptive real-time
/// uniprocessor scheduling", INRIA RR-2966, 1996): non-preemptive EDF meets all deadlines if at
/// every absolute deadline t max{C_j : D_j > t} + sum of demand <= t. Also necessary for sporadic
/// tasks. A violation at or after the end of the synchronous busy period implies an earlier one (the
/// printed "for all t > 0" fails for every set at t < max C). No jitter; deadlines up to the periods.
inline bool george_1996(const PeriodicTasks& tasks, TimeModel model = TimeModel::continuous) {
  const auto released = [&](std::int64_t t) {
    std::int64_t sum = 0;
    for (const PeriodicTask& i : tasks) sum += exact::ceil_div(t, i.period) * i.wcet;
    return sum;
  };
  if (const std::int64_t h = hyperperiod(tasks); released(h) > h) return false;
  std::int64_t end = 1;
  while (released(end) > end) end = released(end);
  std::set<std::int64_t> deadlines;
  for (const PeriodicTask& i : tasks) {
    for (std::int64_t t = i.deadline; t < end; t += i.period) deadlines.insert(t);
  }
  return std::all_of(deadlines.begin(), deadlines.end(), [&](std::int64_t t) {
    std::int64_t demand = 0, blocking = 0;
    for (const PeriodicTask& i : tasks) {
      if (i.deadline > t) {
        blocking = std::max(blocking, i.wcet - (model == TimeModel::discrete ? 1 : 0));
      } else {
        demand += ((t - i.deadline) / i.period + 1) * i.wcet;
      }
    }
    return demand + blocking <= t;
  });
}

}  // namespace hotpath
