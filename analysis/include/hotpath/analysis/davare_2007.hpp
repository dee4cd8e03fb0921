// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Equation (6) of the paper: sum of (T_i + R_i) over the chain (Davare et al.: "Period
/// optimization for hard real-time distributed automotive systems", DAC 2007). Bounds the maximum
/// reaction time and the maximum data age, which are equal (Guenzel et al., ECRTS 2023). Sporadic
/// tasks.
std::int64_t davare_2007(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain);

}  // namespace hotpath
