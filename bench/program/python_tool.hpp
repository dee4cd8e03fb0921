// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Runs `COMMAND ARGUMENTS` of the Python package hotpath_report, whose standard output is ours. Throws
/// UsageError with its last sentence where it refuses its input, else RunError.
void run_python_tool(const std::string& command, const std::vector<std::string>& arguments);

/// The same for the picture that belongs to a folder of results: what is missing for it is said on standard
/// error, and the results are complete without it. HOTPATH_FIGURES=none in the environment leaves all such
/// figures out.
void draw_figure(const std::string& command, const std::filesystem::path& folder);

}  // namespace hotpath
