// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ext/stdio_filebuf.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <system_error>
#include <variant>

namespace hotpath::program {

/// The content of a file: text, JSON (a line break is added), or a function that writes it.
using FileContent = std::variant<std::string, nlohmann::json, std::function<void(std::ostream&)>>;

/// Creates a new file; fails if the name exists, also as a link. Returns a descriptor, or -1 with
/// errno set.
[[nodiscard]] int create_file(const std::filesystem::path& file);

/// Writes to a descriptor and closes it. With a negative descriptor every write fails.
class FileStream : public std::ostream {
 public:
  explicit FileStream(int descriptor = -1);
  FileStream(const FileStream&) = delete;
  FileStream& operator=(const FileStream&) = delete;
  ~FileStream() override { close(); }
  void close();

 private:
  __gnu_cxx::stdio_filebuf<char> buffer_;
};

/// fsync() of a file's content, or of a folder's entries.
[[nodiscard]] std::error_code await_disk(const std::filesystem::path& path);

/// Syncs the content of `part`, renames it to `file`, and syncs the directory entry.
[[nodiscard]] std::error_code name_durably(const std::filesystem::path& part,
                                           const std::filesystem::path& file);

/// `write` creates and fills a folder under a temporary name, which is renamed to `folder` after
/// its content is synced. Follows a symbolic link. Throws RunError and then leaves nothing behind.
void write_whole_folder(const std::filesystem::path& folder,
                        const std::function<void(const std::filesystem::path&)>& write);

/// Writes a file under a temporary name and renames it after its content is synced, which replaces
/// a file or link of that name. On failure (disk full, for example) it leaves nothing behind and
/// throws RunError, or UsageError that names `option`, the option that chose the folder.
void write_whole_file(const std::filesystem::path& file, const FileContent& content);
void write_whole_file(const std::filesystem::path& file, const std::string& option,
                      const FileContent& content);

/// Writes the file that `option` names. Unlike write_whole_file() it follows a symbolic link, and
/// writes into a device or FIFO instead of replacing it.
void write_output_file(const std::filesystem::path& file, const std::string& option,
                       const FileContent& content);

/// write_whole_file() that creates the file's folder if it is missing.
void write_with_folder(const std::filesystem::path& file, const std::string& text);

/// Creates a folder and its parents, and syncs their directory entries. Throws UsageError that
/// names `option`.
void create_folder(const std::filesystem::path& folder, const std::string& option = "--output");

}  // namespace hotpath::program
