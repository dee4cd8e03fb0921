// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Runs one of the plot scripts on a result folder. What is missing for it is said on standard error; the
/// results stand without the figure.
void draw_figure(const std::string& script, const std::filesystem::path& folder);

/// The same for a figure that was asked for. Throws UsageError for input that cannot be drawn, else RunError.
void require_figure(const std::string& script, const std::vector<std::string>& arguments);

}  // namespace hotpath
