// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// The longest duration and the latest instant that a file may contain: 36 years, so that sums of a
/// few values do not overflow.
inline constexpr Duration kLongest{std::int64_t{1} << 60};

/// Origin of a CSV file, which determines its layout rules.
enum class CsvLayout : std::uint8_t {
  written,  ///< By a program: every line is a row, and every character counts.
  by_hand,  ///< Blank lines, and blanks around fields, are ignored.
};

/// Streams a CSV file row by row: a header with the column names, then rows with as many fields.
/// Fields are separated by commas and never quoted; a carriage return at the end of a line is
/// ignored. Every problem of a file is reported as an InputError with the line number.
class CsvReader {
 public:
  /// Throws InputError for a file that cannot be read.
  explicit CsvReader(const std::filesystem::path& file, CsvLayout layout = CsvLayout::written);
  /// Reads what is left of `lines`. `columns`, for files that may lack a header: if the first line does
  /// not begin with the name of the first one, it is a row, and these are the names.
  explicit CsvReader(LineReader lines, CsvLayout layout = CsvLayout::written,
                     std::vector<std::string> columns = {});

  /// Column names; empty for an empty file.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }
  void require_header(std::string_view expected) const;
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;
  /// Index of a required column. Throws InputError if it is missing.
  [[nodiscard]] std::size_t column(std::string_view name) const;

  /// Advances to the next row; false at the end of the file.
  [[nodiscard]] bool next();
  /// Line number of the row, or of the header before the first row; counts from 1.
  [[nodiscard]] std::size_t line() const { return lines_.line(); }

  /// A field of the row; valid until the next call of next().
  [[nodiscard]] std::string_view text(std::size_t column) const { return fields_[column]; }
  [[nodiscard]] std::string_view text(std::string_view name) const { return text(column(name)); }

  /// A field as a decimal number. The whole field must be a number within the range of the type;
  /// throws InputError otherwise.
  template <class Number>
  [[nodiscard]] Number number(std::size_t column) const {
    if (const auto value = parse<Number>(text(column))) return *value;
    fail_number(column, std::is_floating_point_v<Number> ? "number" : "whole number");
  }
  template <class Number>
  [[nodiscard]] Number number(std::string_view name) const {
    return number<Number>(column(name));
  }

  /// A field in nanoseconds with a magnitude of at most kLongest. Throws InputError.
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
