// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "results/summary.hpp"

namespace hotpath {

/// For each chain one table with a row per executor, each interval below its value; a graph without chains
/// gives one table of its jobs. Below it for each executor the tasks that starved, at most ten: those that
/// never ran, and timers a job of which waited longer than their period. Then whether the loss equations
/// hold, and what else the reader must know. Plain ASCII, at most 120 columns as long as executors' names
/// stay within 9 characters and latencies within 1 s. `-`: not measured.
void write_table(std::ostream& out, const Summary& summary);

}  // namespace hotpath
