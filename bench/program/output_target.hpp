// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace hotpath {

/// Where an output goes.
struct OutputTarget {
  std::filesystem::path name;  ///< Behind all symbolic links.
  bool in_place = false;       ///< No regular file, or one that is open already: is written to, not replaced.
  int descriptor = -1;         ///< Of this process, where the name stands for one, as /dev/stdout does.
  std::error_code error;       ///< Why nothing can be written there, as far as can be known beforehand.
};

/// Follows symbolic links. Opens nothing.
[[nodiscard]] OutputTarget find_target(const std::filesystem::path& file);

/// Where a file or folder is created: the folder of its name.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& file);

/// For commands that compute for long: throws UsageError that names `option` unless the file can be written.
void check_output_file(const std::filesystem::path& file, const std::string& option);

/// The same for a folder, which is new, or empty, or holds `mark`: the file by which an earlier result of the
/// same command is known, which may be replaced.
void check_output_folder(const std::filesystem::path& folder, const std::string& mark = "",
                         const std::string& option = "--output");

}  // namespace hotpath
