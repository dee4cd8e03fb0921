// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/exploration.hpp"

namespace hotpath {

/// Throws ExplorationRefused for a system that is not explored.
void check_explorable(const TaskSet& set, const ExplorationOptions& options, const Scheduler& scheduler,
                      const Workload& workload);

/// The least common multiple of the timers' periods, in ns. Throws ExplorationRefused if it is too long.
[[nodiscard]] std::int64_t hyperperiod(const TaskSet& set);

}  // namespace hotpath
