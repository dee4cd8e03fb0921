// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "import/trace_events.hpp"
#include "import/whole_packets.hpp"

namespace hotpath {

/// Reads CTF 1.8 traces with libbabeltrace2, merged by time, and passes the events of ros2_tracing
/// to `visitor`. `progress`, if given, gets the share of the trace's time that has been read, 0 to
/// 1, from time to time. Memory does not grow with the trace. Throws UsageError with a remedy if no
/// trace can be read. Of a trace that breaks off the readable part is visited, and
/// TraceReading::broken_off gives the reason. Throws RunError in a build without libbabeltrace2.
[[nodiscard]] TraceReading read_ctf(const WholePackets& trace, TraceVisitor& visitor,
                                    const std::function<void(double)>& progress = {});

}  // namespace hotpath
