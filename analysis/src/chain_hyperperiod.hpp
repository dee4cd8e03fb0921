// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Least common multiple of the periods of a checked chain. Throws AnalysisError if a period is not
/// positive, or if the hyperperiod overflows or has more than kMaxChainReleases releases of the
/// first task.
std::int64_t chain_hyperperiod(const PeriodicTasks& tasks, const TaskChain& chain, const char* method);

}  // namespace hotpath
