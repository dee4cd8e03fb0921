// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "results/summary.hpp"

namespace hotpath::results {

/// Writes one table per chain with a row per executor and each interval below its value, or one
/// table of jobs for a graph without chains. At most ten starved tasks per executor follow: tasks
/// that never ran, and timers with a job that waited longer than the period. Notes follow, such as
/// whether the loss equations hold. Plain ASCII, at most 120 columns if executor names have at most
/// 9 characters and latencies are below 1 s. `-`: not measured.
void write_table(std::ostream& out, const Summary& summary);

}  // namespace hotpath::results
