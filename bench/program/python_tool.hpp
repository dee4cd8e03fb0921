// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Becomes `COMMAND ARGUMENTS` of the Python package hotpath_report, which says itself what is wrong with its
/// input, and whose exit codes are ours. Throws RunError when Python cannot be started.
[[noreturn]] void become_python_tool(const std::string& command, const std::vector<std::string>& arguments);

/// Runs a command that draws the picture that belongs to a folder of results: what is missing for it is said
/// on standard error, and the results are complete without it. HOTPATH_FIGURES=none in the environment leaves
/// all such figures out.
void draw_figure(const std::string& command, const std::filesystem::path& folder);

}  // namespace hotpath
