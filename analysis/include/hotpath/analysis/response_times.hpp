// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// One upper bound for each task of a set, in its order, relative to the nominal release; none where the
/// method finds no bound.
using ResponseTimes = std::vector<std::optional<std::int64_t>>;

/// Every task has a bound, and it is within the deadline.
bool schedulable(const PeriodicTasks& tasks, const ResponseTimes& bounds);

}  // namespace hotpath
