// SPDX-License-Identifier: Apache-2.0
#include "program/table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::program {

namespace {

std::string text_of(const Number& number) {
  const bool decimals = number.form == Number::Form::decimals;
  return text(decimals ? "%.*f" : "%.*g", number.digits, number.value);
}

nlohmann::json json_of(const Number& number) {
  const std::string shown = text_of(number);
  if (!std::isfinite(number.value)) return shown;
  const double rounded = std::strtod(shown.c_str(), nullptr);
  const bool whole = number.form == Number::Form::significant && rounded == std::round(rounded) &&
                     std::abs(rounded) < std::pow(10, std::min(number.digits, 15));
  return whole ? nlohmann::json(static_cast<std::int64_t>(rounded)) : nlohmann::json(rounded);
}

nlohmann::json json_of(const Value& value) {
  const auto content = [](const auto& held) -> nlohmann::json {
    using Held = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<Held, std::monostate>) {
      return nullptr;
    } else if constexpr (std::is_same_v<Held, Number>) {
      return json_of(held);
    } else if constexpr (std::is_same_v<Held, std::string>) {
      return held.empty() ? nlohmann::json() : nlohmann::json(held);
    } else {
      return held;
    }
  };
  return std::visit(content, value);
}

void write_markdown_row(std::ostream& out, const std::vector<std::string>& cells) {
  out << "| " << joined(cells, " | ") << " |\n";
}

}  // namespace

std::optional<Number> with_decimals(std::optional<double> value, int decimals) {
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return Number{*value, decimals, Number::Form::decimals};
}

std::string text_of(const Value& value, const std::string& none) {
  const auto content = [&](const auto& held) -> std::string {
    using Held = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<Held, std::monostate>) {
      return none;
    } else if constexpr (std::is_same_v<Held, Number>) {
      return text_of(held);
    } else if constexpr (std::is_same_v<Held, std::string>) {
      return held;
    } else {
      return std::to_string(held);
    }
  };
  return std::visit(content, value);
}

void write_csv_row(std::ostream& out, const std::vector<Value>& row) {
  const char* before = "";
  for (const Value& value : row) {
    out << before << csv_field(text_of(value));
    before = ",";
  }
  out << '\n';
}

void write_csv(std::ostream& out, const Table& table) {
  out << joined(table.header, ",") << '\n';
  for (const std::vector<Value>& row : table.rows) write_csv_row(out, row);
}

std::string csv_of(const Table& table) {
  std::ostringstream out;
  write_csv(out, table);
  return out.str();
}

nlohmann::json json_of(const Table& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const std::vector<Value>& row : table.rows) {
    nlohmann::json& object = rows.emplace_back(nlohmann::json::object());
    for (std::size_t i = 0; i < row.size(); ++i) object[table.header[i]] = json_of(row[i]);
  }
  return rows;
}

void write_markdown(std::ostream& out, const Table& table, const std::vector<std::size_t>& numbers) {
  std::vector<std::string> alignment(table.header.size(), "---");
  for (const std::size_t column : numbers) alignment[column] = "---:";
  write_markdown_row(out, table.header);
  write_markdown_row(out, alignment);
  for (const std::vector<Value>& row : table.rows) {
    std::vector<std::string> cells;
    for (const Value& value : row) cells.push_back(markdown(text_of(value)));
    write_markdown_row(out, cells);
  }
}

}  // namespace hotpath::program
