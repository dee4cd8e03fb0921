// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/run_memory.hpp"
#include "live/repetition_runner.hpp"

namespace hotpath::live {

/// For each worker of a process: its number in the whole run.
[[nodiscard]] std::vector<std::uint16_t> workers_of(const Plan& plan, std::uint32_t process);

/// The end of a run whose processes have all stopped, the last one at `stopped`. A run that ends early
/// ends behind every start: each process stops at an instant of its own, and the others go on until they
/// stop as well. `planned`: no run ends later.
[[nodiscard]] Time end_of_run(Time stopped, Time planned, const std::deque<RunMemory>& memories);

/// The trace of a repetition that did not begin.
[[nodiscard]] Trace empty_trace(const Plan& plan);

/// What all processes recorded, in the order of starts, with the chains. A job that was decided for but
/// had not finished by `end` is `running`.
[[nodiscard]] Trace collected_trace(const Plan& plan, const std::deque<RunMemory>& memories, Time epoch,
                                    Time end);

/// A sentence on the timers that left the grid of their timestamps, for a run with given phases; empty: none
/// did. Two things lead off the grid (rcl/timer.c keeps the phase of a late timer): the call was more than a
/// period late, so that timestamps were skipped; or a timer management thread released a job over a
/// millisecond late. Executors without such a thread notice due timers between two jobs, which is part of
/// their guarantees.
[[nodiscard]] std::string left_grid(const TaskSet& set, const setup::ExecutorSpec& executor,
                                    const results::Repetition& repetition);

}  // namespace hotpath::live
