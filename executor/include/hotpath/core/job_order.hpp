// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The tasks of a schedule's jobs, in the order of their starts.
using JobOrder = std::vector<TaskId>;

/// Twice the length of the longest common subsequence divided by the sum of both lengths: 1 for the
/// same order, and an upper bound of the ratio of Python's difflib. Two empty orders are equal.
/// Takes time proportional to the product of the lengths.
[[nodiscard]] double similarity(const JobOrder& a, const JobOrder& b);

/// Replaces every task by the first task with the same kind and period, so that comparisons ignore
/// the order among tasks of equal period.
[[nodiscard]] JobOrder by_period(JobOrder order, const TaskSet& set);

}  // namespace hotpath
