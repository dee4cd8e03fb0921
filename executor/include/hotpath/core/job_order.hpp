// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The tasks of a schedule's jobs in the order of their starts.
using JobOrder = std::vector<TaskId>;

/// Twice the length of the longest common subsequence over the sum of both lengths: 1 for the same order, the
/// best value that difflib's ratio could reach. Two empty orders are the same. Time grows with the product
/// of the lengths.
[[nodiscard]] double similarity(const JobOrder& a, const JobOrder& b);

/// With every task replaced by the first of its kind and period: blind to the order among equal periods.
[[nodiscard]] JobOrder by_period(JobOrder order, const TaskSet& set);

}  // namespace hotpath
