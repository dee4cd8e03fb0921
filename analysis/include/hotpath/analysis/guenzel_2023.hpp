// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Limit of releases of a chain's first task in one hyperperiod; beyond it the phase-aware methods
/// give up.
inline constexpr std::int64_t kMaxChainReleases = 10'000'000;

/// Latency of a chain of periodic tasks with known phases (Guenzel, Ueter, Chen, Chen:
/// "Inter-cluster communication / mixed cause-effect chains", RTNS 2023, periodic form). An event
/// right after the read of the job released at z waits for the next job of the first task, and from
/// there for the first release of each task at or after r_i + x_i R_i. The result is the maximum
/// over all z of one hyperperiod of the chain, starting at the largest phase, when all its tasks
/// have started. Bounds the maximum reaction time and the maximum data age. Throws AnalysisError
/// for a hyperperiod that overflows or has more than kMaxChainReleases releases.
std::int64_t guenzel_2023(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                          Priorities priorities = Priorities::fixed);

}  // namespace hotpath
