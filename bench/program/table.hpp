// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath::program {

/// A number with the precision in which every writer shows it.
struct Number {
  enum class Form : std::uint8_t { significant, decimals };
  double value = 0;
  int digits = 6;
  Form form = Form::significant;
};

/// `value` with this number of decimals; no value unless it is finite.
[[nodiscard]] std::optional<Number> with_decimals(std::optional<double> value, int decimals);

/// A cell: nothing, a whole number, a number or a text.
using Value = std::variant<std::monostate, std::int64_t, std::uint64_t, Number, std::string>;

/// A member of a row as a value: durations in nanoseconds, enumerations as their words, fractions in
/// `digits` significant digits.
template <class T>
[[nodiscard]] Value value_of(const T& member, int digits = 6) {
  if constexpr (requires { member.has_value(); }) {
    return member ? value_of(*member, digits) : Value();
  } else if constexpr (std::is_same_v<T, Duration>) {
    return Value(std::int64_t{member.count()});
  } else if constexpr (EnumWithTexts<T>) {
    return Value(std::string(to_string(member)));
  } else if constexpr (std::is_floating_point_v<T>) {
    return Value(Number{member, digits});
  } else if constexpr (std::is_unsigned_v<T>) {
    return Value(std::uint64_t{member});
  } else if constexpr (std::is_integral_v<T>) {
    return Value(std::int64_t{member});
  } else {
    return Value(member);
  }
}

/// A column of rows of a type: the name, which ends in the unit, and the member or function that gives
/// the value. The type of the member is the kind of the column.
template <class Row>
struct Column {
  template <class Of>
  Column(std::string column, Of of, int digits = 6)
      : name(std::move(column)),
        value([of, digits](const Row& row) { return value_of(std::invoke(of, row), digits); }) {}

  std::string name;
  std::function<Value(const Row&)> value;
};

/// What a command shows and stores: made once, and written as text (TextTable), CSV, JSON or Markdown.
struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<Value>> rows;
};

template <class Row>
[[nodiscard]] std::vector<Value> values_of(const std::vector<Column<Row>>& columns, const Row& row) {
  std::vector<Value> values;
  for (const Column<Row>& column : columns) values.push_back(column.value(row));
  return values;
}

template <class Row>
[[nodiscard]] Table table_of(const std::vector<Column<Row>>& columns, const std::vector<Row>& rows) {
  Table table;
  for (const Column<Row>& column : columns) table.header.push_back(column.name);
  for (const Row& row : rows) table.rows.push_back(values_of(columns, row));
  return table;
}

/// A value as text; `none` for none.
[[nodiscard]] std::string text_of(const Value& value, const std::string& none = "");

/// The header and the rows, with quotes where a field needs them.
void write_csv(std::ostream& out, const Table& table);
[[nodiscard]] std::string csv_of(const Table& table);
/// A line of CSV.
void write_csv_row(std::ostream& out, const std::vector<Value>& row);

/// An object for each row; null for no value and for an empty text.
[[nodiscard]] nlohmann::json json_of(const Table& table);

/// A table in Markdown. `numbers`: the columns that are aligned to the right, from 0.
void write_markdown(std::ostream& out, const Table& table, const std::vector<std::size_t>& numbers);

}  // namespace hotpath::program
