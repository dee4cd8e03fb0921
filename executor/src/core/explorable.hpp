// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/exploration.hpp"
#include "hotpath/core/explored_scheduler.hpp"

namespace hotpath {

/// `scheduler`, as that of a system that is explored. Throws ExplorationRefused for any other.
const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload);

/// The least common multiple of the timers' periods, in ns. Throws ExplorationRefused if it is too long.
[[nodiscard]] std::int64_t hyperperiod(const TaskSet& set);

}  // namespace hotpath
