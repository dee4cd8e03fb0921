// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/exploration.hpp"
#include "hotpath/core/explored_scheduler.hpp"

namespace hotpath {

/// `scheduler`, as that of a system that is explored. Throws ExplorationRefused for any other, and for what
/// is not covered beside it: several threads that run jobs need a core each, and only jobs take time then.
const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload);

}  // namespace hotpath
