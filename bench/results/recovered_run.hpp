// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "results/summary.hpp"

namespace hotpath::results {

/// Turns the folder of a killed run into a result: keeps the repetitions that run.json names, drops
/// the rows of the interrupted repetition, and sets `partial` in run.json. Throws UsageError if the
/// run is still running, is whole, or had not finished a repetition; InputError for malformed
/// files; RunError if the folder cannot be written, which then stays unchanged.
Summary recover_run(const std::filesystem::path& folder);

}  // namespace hotpath::results
