// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::live {

/// A sentence on the timers that left the grid of their timestamps, for a run with given phases; empty: none
/// did. Two things lead off the grid (rcl/timer.c keeps the phase of a late timer): the call was more than a
/// period late, so that timestamps were skipped; or a timer management thread released a job over a
/// millisecond late. Executors without such a thread notice due timers between two jobs, which is part of
/// their guarantees.
[[nodiscard]] std::string left_grid(const TaskSet& set, const setup::ExecutorSpec& executor,
                                    const results::Repetition& repetition);

}  // namespace hotpath::live
