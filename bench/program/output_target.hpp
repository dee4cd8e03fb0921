// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace hotpath::program {

/// The target of an output file.
struct OutputTarget {
  std::filesystem::path name;  ///< Behind all symbolic links.
  bool in_place = false;       ///< Write to it instead of replacing it: not a regular file, or already open.
  int descriptor = -1;         ///< The descriptor of this process that the name denotes, as /dev/stdout does.
  std::error_code error;       ///< Why it cannot be written, as far as known beforehand.
};

/// Follows symbolic links without opening the file.
[[nodiscard]] OutputTarget find_target(const std::filesystem::path& file);

/// The folder that contains a file or folder.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& file);

/// Throws UsageError that names `option` if there is an error: says `what` failed, and to name another
/// `remedy`, such as ` place`.
void require(const std::error_code& error, const std::string& option, const std::string& what,
             const char* remedy = "");

/// Throws UsageError that names `option` unless the file can be written. Call it before a long
/// computation.
void check_output_file(const std::filesystem::path& file, const std::string& option);

/// The same for a folder, which must be new, empty, or contain `mark`: the file that identifies an
/// earlier result of the same command, which may be replaced.
void check_output_folder(const std::filesystem::path& folder, const std::string& mark = "",
                         const std::string& option = "--output");

}  // namespace hotpath::program
