// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "live/run_options.hpp"

namespace hotpath {

/// Runs all repetitions of all executors, interleaved in seeded random order, into one result folder; prints
/// the table and draws the figures. Throws UsageError, InputError, RunError.
void run_live(const RunOptions& options);

}  // namespace hotpath
