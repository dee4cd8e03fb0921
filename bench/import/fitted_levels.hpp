// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "import/hypothesis.hpp"

namespace hotpath::imports {

/// Fits the order of the timers' given priorities, or relative deadlines, to the first `starts`
/// decisions by local search from two sides: by period, and all equal. Subscriptions have none of
/// their own.
void fit_levels(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts);

}  // namespace hotpath::imports
