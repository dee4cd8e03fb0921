// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulated/simulate_options.hpp"

namespace hotpath {

/// Simulates all repetitions of all executors, then writes one result folder, prints the table and draws the
/// figure. The same options give the same files, byte by byte. Throws UsageError, InputError, RunError; what
/// cannot be simulated to its end leaves nothing behind.
void run_simulated(const SimulateOptions& options);

}  // namespace hotpath
