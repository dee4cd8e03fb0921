// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Writes the jobs of a trace that ran within [from, to) as Chrome trace JSON, which ui.perfetto.dev opens:
/// a track for each worker of each process, a slice for each job, a marker for each overwritten sample,
/// skipped timestamp and missed deadline, and a flow from every job to those that took its message. Stream
/// errors are the caller's to check.
void write_perfetto(std::ostream& out, const TaskSet& set, const Trace& trace, Time from, Time to);

}  // namespace hotpath
