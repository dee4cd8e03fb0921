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

namespace hotpath {

/// What a file holds: text, JSON (with a line break at its end), or what a function writes.
using FileContent = std::variant<std::string, nlohmann::json, std::function<void(std::ostream&)>>;

/// Creates a file that was not there before. Never opens one through a link.
[[nodiscard]] int create_file(const std::filesystem::path& file);

/// Writes to a descriptor, which it closes. Without a descriptor, or with a negative one, nothing can be
/// written.
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

/// Waits until a file's content, or the names in a folder, would survive a loss of power.
[[nodiscard]] std::error_code await_disk(const std::filesystem::path& path);

/// Gives `part` the name `file` once its content is on disk, and waits until the name is.
[[nodiscard]] std::error_code name_durably(const std::filesystem::path& part,
                                           const std::filesystem::path& file);

/// Lets `write` create and fill a folder elsewhere, which gets the name `folder` once all that is in it is on
/// disk. A symbolic link is followed. Throws RunError, and leaves nothing behind then.
void write_whole_folder(const std::filesystem::path& folder,
                        const std::function<void(const std::filesystem::path&)>& write);

/// Writes a file, which gets its name when it is whole and on disk; a file or link that has the name is
/// replaced then. Leaves nothing behind when it cannot be written (disk full, for example), and throws
/// RunError, or UsageError that names `option`, which named the folder.
void write_whole_file(const std::filesystem::path& file, const FileContent& content);
void write_whole_file(const std::filesystem::path& file, const std::string& option,
                      const FileContent& content);

/// Writes the file that `option` names. As write_whole_file(), with two differences for names that the user
/// chose: a symbolic link is followed, and what is no regular file (a device, a FIFO) is written to.
void write_output_file(const std::filesystem::path& file, const std::string& option,
                       const FileContent& content);

/// The same as write_whole_file() for a file whose folder may be missing.
void write_with_folder(const std::filesystem::path& file, const std::string& text);

/// Creates a folder and those above it, and waits until their names are on disk. Throws UsageError that names
/// `option`.
void create_folder(const std::filesystem::path& folder, const std::string& option = "--output");

}  // namespace hotpath
