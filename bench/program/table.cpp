// SPDX-License-Identifier: Apache-2.0
#include "program/table.hpp"

#include "program/shown_text.hpp"

namespace hotpath::program {

TextTable text_of(const std::string& title, const Table& table) {
  TextTable shown(title, table.header);
  for (const std::vector<Value>& row : table.rows) {
    std::vector<TextTable::Cell> cells;
    cells.reserve(row.size());
    for (const Value& value : row) cells.emplace_back(value.text());
    shown.add_row(cells);
  }
  return shown;
}

std::string csv_of(const std::vector<std::vector<Value>>& rows) {
  std::string csv;
  for (const std::vector<Value>& row : rows) {
    for (const Value& value : row) csv += csv_field(value.text()) + ",";
    csv.back() = '\n';
  }
  return csv;
}

std::string csv_of(const Table& table) { return joined(table.header, ",") + "\n" + csv_of(table.rows); }

nlohmann::json json_of(const Table& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const std::vector<Value>& row : table.rows) {
    nlohmann::json& object = rows.emplace_back(nlohmann::json::object());
    for (std::size_t i = 0; i < row.size(); ++i) object[table.header[i]] = row[i].data();
  }
  return rows;
}

std::string markdown_of(const Table& table, const std::vector<std::size_t>& numbers) {
  std::vector<std::string> alignment(table.header.size(), "---");
  for (const std::size_t column : numbers) alignment[column] = "---:";
  std::string page = "| " + joined(table.header, " | ") + " |\n| " + joined(alignment, " | ") + " |\n";
  for (const std::vector<Value>& row : table.rows) {
    page += "|";
    for (const Value& value : row) page += " " + markdown(value.text()) + " |";
    page += "\n";
  }
  return page;
}

}  // namespace hotpath::program
