// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

namespace hotpath {

/// Writes a file that gets its name when it is whole. Throws UsageError, which names `option`, when it cannot
/// be written, and leaves nothing behind.
void write_whole_file(const std::filesystem::path& file, const std::string& option,
                      const std::function<void(std::ostream&)>& write);

}  // namespace hotpath
