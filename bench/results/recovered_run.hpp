// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "results/summary.hpp"

namespace hotpath {

/// Turns the folder of a run that was killed into a result: the repetitions that run.json names are kept,
/// rows of the one that was going on are left out, and run.json says `partial`. Throws UsageError when the
/// run goes on, is whole, or had not finished a repetition; InputError for what is malformed; RunError when
/// the folder cannot be written, which leaves it as it was.
Summary recover_run(const std::filesystem::path& folder);

}  // namespace hotpath
