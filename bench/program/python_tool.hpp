// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath::program {

/// Executes `COMMAND ARGUMENTS` of the Python package hotpath_report in place of this process. The
/// package reports errors in its input itself and uses our exit codes. Throws RunError when Python
/// cannot be started.
[[noreturn]] void become_python_tool(const std::string& command, const std::vector<std::string>& arguments);

/// Runs a command of the package and waits for it. Throws UsageError for unusable input, RunError if it
/// fails.
void call_python_tool(const std::string& command, const std::vector<std::string>& arguments);

/// Runs a command that draws the figure of a result folder. A failure is only noted on standard
/// error: the results are complete without the figure. HOTPATH_FIGURES=none in the environment
/// disables all such figures, but not pages.
void draw_figure(const std::string& command, const std::filesystem::path& folder, bool is_page = false);

}  // namespace hotpath::program
