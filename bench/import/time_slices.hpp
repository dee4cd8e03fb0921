// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

/// By job: its time on a processor, where threads share processors in time slices. A trace has no events of
/// the kernel's scheduler. So the recorded starts and ends are followed with the simulator's rule: the thread
/// that starts a job has a processor, the one that had its processor longest lost it, and a thread keeps its
/// processor for a time slice while others wait. `own`: by job; kept for threads that never share so, or of
/// which one has a level (see Displacement). Returns how many threads share processors.
std::size_t follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                               const std::vector<int>& level, std::vector<Duration>& own);

}  // namespace hotpath::imports
