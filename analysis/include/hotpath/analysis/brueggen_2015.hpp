// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Theorem 1 of the paper (von der Brueggen, Chen, Huang: "Schedulability and optimization analysis for
/// non-preemptive static priority scheduling", ECRTS 2015, Eq. 6): the least t <= D_k with
/// t >= C_k + max_{i>k} C_i + sum_{i<k} ceil(t / T_i) C_i. Sporadic tasks, D <= T, no jitter.
ResponseTimes brueggen_2015(const PeriodicTasks& tasks);

}  // namespace hotpath
