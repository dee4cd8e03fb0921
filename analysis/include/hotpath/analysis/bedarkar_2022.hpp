// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// FIFO, as of the unmodified events executor while no timestamp is skipped: largest backlog at an arrival
/// within the synchronous busy period, which without jitter and overload is that at its beginning: one job of
/// each task (Bedarkar et al.: "From intuition to Coq", RTSS 2022). Sporadic tasks; the same bound for every
/// task. Throws AnalysisError for jitter or a utilisation above 1.
std::int64_t bedarkar_2022(const PeriodicTasks& tasks);

}  // namespace hotpath
