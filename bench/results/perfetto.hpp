// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

#include "results/stored_run.hpp"

namespace hotpath::results {

/// A time window of one repetition, counted from its epoch.
struct TraceWindow {
  std::string executor;
  std::uint32_t repetition = 0;
  Time from{}, to = kNever;
};

/// Writes the jobs of a run that touch the window [from, to) in Chrome's Trace Event Format, with a flow
/// from each publishing job to those that took its message. Throws UsageError if the repetition did not
/// run, and InputError.
void write_perfetto(std::ostream& out, const StoredRun& run, const TraceWindow& window);

}  // namespace hotpath::results
