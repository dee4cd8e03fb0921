// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// One upper bound per task of a set, in its order, relative to the nominal release; std::nullopt
/// if the method finds no bound.
using ResponseTimes = std::vector<std::optional<std::int64_t>>;

/// Whether every task has a bound within its deadline.
bool schedulable(const PeriodicTasks& tasks, const ResponseTimes& bounds);

}  // namespace hotpath
