// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace hotpath {

/// The folders at or below `folder` that hold a CTF 1.8 trace each. Throws UsageError with a remedy
/// if there is none, or a trace in another format.
[[nodiscard]] std::vector<std::filesystem::path> ctf_folders(const std::filesystem::path& folder);

}  // namespace hotpath
