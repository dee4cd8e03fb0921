// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hotpath {

/// A problem of an input file that the user can correct: `FILE:LINE: problem; remedy`.
struct InputError : std::runtime_error {
  /// `line` counts from 1; 0 means the whole file, and the message then has no line number.
  InputError(const std::string& file, std::int64_t line, const std::string& problem,
             const std::string& remedy)
      : std::runtime_error(file + (line > 0 ? ":" + std::to_string(line) : "") + ": " + problem + "; " +
                           remedy) {}
};

/// Throws the InputError for an input that cannot be read: `FILE: cannot be read (REASON); REMEDY`.
/// `line`: as for InputError.
[[noreturn]] void refuse_input(const std::string& file, const std::string& reason, const std::string& remedy,
                               std::int64_t line = 0);

/// Opens a file that the user named. Accepts only regular files: a device may never end, and a FIFO
/// may have no writer. Throws InputError; `remedy` tells the user which file to give instead.
[[nodiscard]] std::ifstream open_input(const std::filesystem::path& file, const std::string& remedy);

/// Reads a file line by line. Lines are limited to 4 MiB, which bounds the memory for a file
/// without line breaks.
class LineReader {
 public:
  /// `in` must outlive the reader; `file` is the name in messages.
  LineReader(std::istream& in, std::string file);

  /// Advances to the next line; false at the end. Throws InputError if the line is too long or
  /// reading fails.
  bool next();

  /// The line without its end, `\n` or `\r\n`; valid until the next call of next().
  [[nodiscard]] std::string_view text() const { return text_; }
  [[nodiscard]] std::size_t line() const { return line_; }  ///< Counts from 1.
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::istream* in_;
  std::string file_;
  std::size_t line_ = 0;
  std::unique_ptr<char[]> buffer_;
  std::string_view text_;
};

}  // namespace hotpath
