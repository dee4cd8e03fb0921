// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Response time bound under FIFO, the order of the unmodified events executor as long as it skips
/// no timestamp: the largest backlog at an arrival within the synchronous busy period. Without
/// jitter and overload that is the backlog at the beginning of the period: one job of each task
/// (Bedarkar et al.: "From intuition to Coq", RTSS 2022). Sporadic tasks; the same bound in
/// nanoseconds for every task. Throws AnalysisError for jitter or a utilisation above 1.
std::int64_t bedarkar_2022(const PeriodicTasks& tasks);

}  // namespace hotpath
