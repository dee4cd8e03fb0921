// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Runs one of the plot scripts on a result folder. What is missing for it is said on standard error; the
/// results stand without the figure. HOTPATH_FIGURES=none in the environment leaves all such figures out.
void draw_figure(const std::string& script, const std::filesystem::path& folder);

/// The same for a figure that was asked for. Throws UsageError for input that cannot be drawn, else RunError.
void require_figure(const std::string& script, const std::vector<std::string>& arguments);

/// Runs a script whose path is relative to the folder of plot scripts and whose standard output is the
/// answer. Throws UsageError with its last sentence where it refuses its input, else RunError with `failure`.
/// @param needs Debian's packages that the script imports.
void require_script(const std::string& script, const std::vector<std::string>& arguments,
                    const std::string& failure, const std::string& needs);

}  // namespace hotpath
