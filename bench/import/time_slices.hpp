// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

/// Sets the time on a processor of each job, where threads of the ordinary policy share processors in time
/// slices. A trace has no events of the kernel's scheduler. So the simulator's rule is replayed with the
/// recorded instants: threads wait in the order in which they become ready, and one that has had its
/// processor for a time slice goes to the end while others wait. Where a waiting thread starts or ends a job,
/// it gets the processor of the thread whose time slice ends first. If that is rare, time slices explain the
/// recording better than priorities do, and each thread may run on all of the shared processors. Otherwise
/// threads of which one has a level, or that share several processors, keep their times.
void follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                        Displacement& displacement);

/// What was found, with instants from `epoch` on.
[[nodiscard]] std::string sentence(const TimeSlices& slices, Time epoch);

}  // namespace hotpath::imports
