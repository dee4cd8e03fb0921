// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "import/trace_events.hpp"
#include "import/whole_packets.hpp"

namespace hotpath {

/// Reads CTF 1.8 traces with libbabeltrace2, merged by time, and hands their events to `visitor`; only those
/// of ros2_tracing are looked into. `progress`, if given, is told now and then which share of the trace's
/// time has been read, 0 to 1. Memory does not grow with the trace. Throws UsageError where there is no trace
/// that can be read, with what to do; what can be read of a trace that breaks off is visited, and
/// TraceReading::broken_off says why. A program that was built without libbabeltrace2 throws RunError.
[[nodiscard]] TraceReading read_ctf(const WholePackets& trace, TraceVisitor& visitor,
                                    const std::function<void(double)>& progress = {});

}  // namespace hotpath
