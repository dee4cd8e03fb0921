// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath::sweep {

/// Runs this program, or another build of it, with these words in its own process, silently and
/// without figures. On failure, throws its last line of output: UsageError for wrong use (exit code
/// 2), else RunError.
void run_hotpath(std::vector<std::string> words, const std::string& program = "");

/// The measures of a finished run.
[[nodiscard]] results::Summary summary_of_folder(const std::filesystem::path& folder);

}  // namespace hotpath::sweep
