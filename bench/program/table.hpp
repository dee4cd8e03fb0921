// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdlib>
#include <functional>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"
#include "program/text.hpp"

namespace hotpath::program {

/// A cell of a table: nothing (from an empty std::optional), a whole number (a duration: in nanoseconds), a
/// fraction, shown with the digits of printf's `format`, a text, also from an enumeration, or JSON, stored as
/// it is. `below`: a second line of text, for the interval of a value.
class Value {
 public:
  Value() = default;
  template <class T>
  Value(const T& member, const char* format = "%.6g") {
    if constexpr (requires { member.has_value(); }) {
      if (member) *this = Value(*member, format);
    } else if constexpr (std::is_same_v<T, Duration>) {
      *this = Value(member.count());
    } else if constexpr (EnumWithTexts<T>) {
      *this = Value(to_string(member));
    } else if constexpr (std::is_floating_point_v<T>) {
      text_ = program::text(format, member);
      if (std::isfinite(member)) data_ = rounded(text_);
    } else if constexpr (std::is_arithmetic_v<T>) {
      data_ = std::is_same_v<T, bool> ? nlohmann::json(member ? 1 : 0) : nlohmann::json(member);
      text_ = data_.dump();
    } else if constexpr (std::is_same_v<T, nlohmann::json>) {
      data_ = member;
      text_ = member.is_null() ? "" : member.is_string() ? member.template get<std::string>() : member.dump();
    } else {
      text_ = member;
    }
    if (data_.is_null() && !text_.empty()) data_ = text_;
  }
  Value(const std::string& shown, const std::string& below)
      : text_(shown), below_(below), data_(below.empty() ? shown : shown + " " + below) {}

  [[nodiscard]] const std::string& text() const { return text_; }  ///< Empty for nothing.
  [[nodiscard]] const std::string& below() const { return below_; }
  /// Null for nothing, and for an empty text; with what stands below.
  [[nodiscard]] const nlohmann::json& data() const { return data_; }

 private:
  /// The number that is shown, a whole number if it is shown as one.
  static nlohmann::json rounded(const std::string& shown) {
    const double value = std::strtod(shown.c_str(), nullptr);
    if (shown.find_first_not_of("-0123456789") != std::string::npos) return value;
    return static_cast<std::int64_t>(value);
  }

  std::string text_, below_;
  nlohmann::json data_;
};

/// A column of rows of a type: the name, which ends in the unit, and the member or function that gives the
/// value, whose type is the kind of the column. `format`: of fractions.
template <class Row>
struct Column {
  template <class Of>
  Column(std::string column, Of of, const char* format = "%.6g")
      : name(std::move(column)),
        value([of, format](const Row& row) { return Value(std::invoke(of, row), format); }) {}
  /// Of rows of JSON: a pointer into the row. "-": there is nothing.
  Column(std::string column, const char* pointer, const char* format = "%.6g")
      : name(std::move(column)), value([at = nlohmann::json::json_pointer(pointer), format](const Row& row) {
          const nlohmann::json found = row.value(at, nlohmann::json("-"));
          return found.is_number_float() ? Value(found.get<double>(), format) : Value(found);
        }) {}

  std::string name;
  std::function<Value(const Row&)> value;
};

/// What a command shows and stores: made once, and written as text (<<), CSV, JSON or Markdown.
struct Table {
  /// `names`: one header per column, with at most one line break. Text has no header if all are empty, and
  /// leaves out a column without any text.
  explicit Table(std::string of_text, std::vector<std::string> names = {})
      : title(std::move(of_text)), header(std::move(names)) {}

  /// `cells`: one per column.
  void add_row(std::vector<Value> cells) { rows.push_back(std::move(cells)); }

  std::string title;  ///< Of text.
  std::vector<std::string> header;
  std::vector<std::vector<Value>> rows;
};

template <class Row>
[[nodiscard]] Table table_of(const std::vector<Column<Row>>& columns, const std::vector<Row>& rows,
                             const std::string& title = "") {
  Table table(title);
  for (const Column<Row>& column : columns) table.header.push_back(column.name);
  for (const Row& row : rows) {
    std::vector<Value>& values = table.rows.emplace_back();
    for (const Column<Row>& column : columns) values.push_back(column.value(row));
  }
  return table;
}

std::ostream& operator<<(std::ostream& out, const Table& table);

/// CSV: the header and the rows, with quotes where a field needs them.
[[nodiscard]] std::string csv_of(const Table& table);

/// An object for each row.
[[nodiscard]] nlohmann::json json_of(const Table& table);

/// {columns, rows}, each row with its cells.
[[nodiscard]] nlohmann::json columns_and_rows(const Table& table);

/// Markdown. `numbers`: the columns, from 0, that are aligned to the right and hold nothing to escape.
[[nodiscard]] std::string markdown_of(const Table& table, const std::vector<std::size_t>& numbers);

}  // namespace hotpath::program
