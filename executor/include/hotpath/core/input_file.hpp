// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <iosfwd>
#include <string>
#include <string_view>

namespace hotpath {

/// Opens a file that a user names. Only a regular one: a device may have no end, and a FIFO no writer. Throws
/// InputError; `remedy` says what to give instead.
[[nodiscard]] std::ifstream open_input(const std::filesystem::path& file, const std::string& remedy);

/// The lines of a file, none of more than 4 MiB: a file without line breaks takes no more memory than that.
class LineReader {
 public:
  /// `in` outlives the reader; `file` is its name in messages, and `lines_before` have been read from it.
  LineReader(std::istream& in, std::string file, std::size_t lines_before = 0);

  /// Goes to the next line; false at the end. Throws InputError for a line that is too long, and where the
  /// file cannot be read further.
  bool next();

  /// Without its end, `\n` or `\r\n`; valid until the next call of next().
  [[nodiscard]] std::string_view text() const { return text_; }
  [[nodiscard]] std::size_t line() const { return line_; }  ///< Counts from 1.
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::istream* in_;
  std::string file_;
  std::size_t line_;
  std::string buffer_;
  std::string_view text_;
};

}  // namespace hotpath
