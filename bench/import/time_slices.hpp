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
/// recording, and each thread may run on all of the shared processors. The first replay has no levels. It
/// fails if, for more than 1 in 20 of its jobs, a thread with a level had to be given a processor, or a
/// thread that uses only some of the processors had one in vain. The second replay has the levels. If both
/// fail, threads keep their times; only threads without levels on one processor always take turns.
void follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                        Displacement& displacement);

/// What was found, with instants from `epoch` on.
[[nodiscard]] std::string sentence(const TimeSlices& slices, Time epoch);

/// What is wrong with threads that share processors in another way.
[[nodiscard]] std::string unexplained_sentence(const TimeSlices& slices);

}  // namespace hotpath::imports
