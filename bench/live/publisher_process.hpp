// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "live/channel.hpp"
#include "live/repetition_runner.hpp"

namespace hotpath {

/// The process that publishes a repetition while it runs (`plan.publishing`), from its fork to its end. It
/// reads what the measured processes record in `memories`, gives way to all others (nice 19), and talks to
/// the coordinator as they do: `matched` when it is ready, then `begin`, then `stop` with the end of the run,
/// then `done` with the number of chain samples lost. Returns the exit code.
int run_publisher_process(const RepetitionPlan& plan, const std::deque<RunMemory>& memories,
                          const Channel& coordinator);

}  // namespace hotpath
