// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hotpath/core/input_error.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// The longest duration, and the latest instant, that a file may tell: 36 years, so that sums of a few of
/// them are no overflow.
inline constexpr Duration kLongest{std::int64_t{1} << 60};

enum class CsvLayout : std::uint8_t {
  written,  ///< By a program: every line is a row, every character counts.
  by_hand,  ///< Blank lines, and blanks around fields, count for nothing.
};

/// Streams a CSV file row by row: a header that names the columns, then rows of as many fields. Fields are
/// separated by commas and never quoted; a carriage return at the end of a line is ignored. All that is wrong
/// with a file is an InputError with its line.
class CsvReader {
 public:
  /// Throws InputError for a file that cannot be read.
  explicit CsvReader(const std::filesystem::path& file, CsvLayout layout = CsvLayout::written);
  /// `in` outlives the reader; `name` is its file's in messages.
  CsvReader(std::istream& in, std::string name, CsvLayout layout = CsvLayout::written);
  /// For files that may lack their header: a first line that does not begin with the name of the first column
  /// is a row, and `columns` are the names. `lines_before` of the file have been read from `in`.
  CsvReader(std::istream& in, std::string name, std::vector<std::string> columns, CsvLayout layout,
            std::size_t lines_before = 0);
  ~CsvReader();
  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Names of the columns; none in an empty file.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }
  void require_header(std::string_view expected) const;
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;
  /// The same for a column without which the file has no meaning. Throws InputError.
  [[nodiscard]] std::size_t column(std::string_view name) const;

  /// Goes to the next row. False at the end of the file.
  [[nodiscard]] bool next();
  /// Line of the row, or of the header before the first one; counts from 1.
  [[nodiscard]] std::size_t line() const { return lines_.line(); }

  /// A field of the row; valid until the next call of next().
  [[nodiscard]] std::string_view text(std::size_t column) const { return fields_[column]; }
  [[nodiscard]] std::string_view text(std::string_view name) const { return text(column(name)); }

  /// The same as a decimal number: all of the field, and in the range of the type.
  template <class Number>
  [[nodiscard]] Number number(std::size_t column) const {
    Number value{};
    const std::string_view field = text(column);
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size()) {
      fail_number(column, std::is_floating_point_v<Number> ? "number" : "whole number");
    }
    return value;
  }
  template <class Number>
  [[nodiscard]] Number number(std::string_view name) const {
    return number<Number>(column(name));
  }

  /// A field of nanoseconds, at most kLongest in size.
  [[nodiscard]] Duration nanoseconds(std::size_t column) const;

  /// Throws InputError for the current line.
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;

 private:
  [[noreturn]] void fail_number(std::size_t column, const char* kind) const;
  bool read_line();

  std::unique_ptr<std::istream> file_;  // for a reader that opened the file itself
  LineReader lines_;
  CsvLayout layout_;
  std::vector<std::string> header_;
  bool first_line_is_row_ = false;
  std::vector<std::string_view> fields_;  // views of the line
};

}  // namespace hotpath
