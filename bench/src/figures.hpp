// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hotpath {

/// Runs one of the plot scripts on a result folder. What is missing for it is said on standard error; the
/// results stand without the figure.
void draw_figure(const std::string& script, const std::filesystem::path& folder);

}  // namespace hotpath
