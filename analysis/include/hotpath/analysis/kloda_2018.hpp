// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Latency of a chain of synchronous periodic tasks, followed from every release of its first task
/// in one hyperperiod of the chain (Kloda, Bertout, Sorel: "Latency analysis for data chains of
/// real-time periodic tasks", ETFA 2018): T_1 + max (r_n - r_1 + R_n) with r_i+1 the first release
/// at or after r_i + x_i R_i. Bounds the maximum reaction time and the maximum data age. Throws
/// AnalysisError for phases other than 0 and for a hyperperiod that overflows or has more than
/// kMaxChainReleases releases.
std::int64_t kloda_2018(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                        Priorities priorities = Priorities::fixed);

}  // namespace hotpath
