// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <variant>

namespace hotpath {

/// What a file holds: text, JSON (with a line break at its end), or what a function writes.
using FileContent = std::variant<std::string, nlohmann::json, std::function<void(std::ostream&)>>;

/// Waits until a file's content, or the names in a folder, would survive a loss of power.
[[nodiscard]] std::error_code await_disk(const std::filesystem::path& path);

/// Gives `part` the name `file` once its content is on disk, and waits until the name is.
[[nodiscard]] std::error_code name_durably(const std::filesystem::path& part,
                                           const std::filesystem::path& file);

/// The same for a folder and all that is in it.
[[nodiscard]] std::error_code name_folder_durably(const std::filesystem::path& part,
                                                  const std::filesystem::path& folder);

/// Writes a file, which gets its name when it is whole and on disk; one that has the name is replaced then.
/// Leaves nothing behind when it cannot be written (disk full, for example), and throws RunError, or, where a
/// file was asked for by an option of the command line, UsageError that names `option`.
void write_whole_file(const std::filesystem::path& file, const FileContent& content);
void write_whole_file(const std::filesystem::path& file, const std::string& option,
                      const FileContent& content);

/// The same for a file whose folder may be missing.
void write_with_folder(const std::filesystem::path& file, const std::string& text);

/// Creates a folder and those above it, and waits until their names are on disk. Throws UsageError that names
/// `option`.
void create_folder(const std::filesystem::path& folder, const std::string& option = "--output");

}  // namespace hotpath
