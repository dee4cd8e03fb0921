// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// Runs this program, or another build of it, with these words in a process of its own, silently and without
/// figures. Where it fails, the last that it said is thrown: as UsageError what it refuses as wrong use (exit
/// code 2), as RunError anything else.
void run_hotpath(std::vector<std::string> words, const std::string& program = "");

/// The measures of a finished run.
[[nodiscard]] Summary summary_of_folder(const std::filesystem::path& folder);

}  // namespace hotpath
