// SPDX-License-Identifier: Apache-2.0
#include "program/table.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <ostream>

#include "program/shown_text.hpp"

namespace hotpath::program {

namespace {

constexpr std::size_t kBetweenColumns = 2;

/// Number of UTF-8 characters: all bytes except continuation bytes.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const Table& table) {
  constexpr std::size_t kHeader = 2;
  const std::size_t columns = table.header.size();
  std::vector<std::vector<std::string>> lines(kHeader);
  for (const std::string& text : table.header) {
    const std::size_t lower = text.find('\n') + 1;  // 0 without a line break
    lines[0].push_back(text.substr(0, std::max<std::size_t>(lower, 1) - 1));
    lines[1].push_back(text.substr(lower));
  }
  for (const std::vector<Value>& row : table.rows) {
    for (const auto of : {&Value::text, &Value::below}) {
      std::vector<std::string>& line = lines.emplace_back();
      for (const Value& value : row) line.push_back((value.*of)());
    }
  }
  std::vector<std::size_t> widest(columns);
  std::vector<bool> left(columns);  // alignment: the first column and columns with words
  for (std::size_t l = 0; l < lines.size(); ++l) {
    for (std::size_t c = 0; c < columns; ++c) {
      widest[c] = std::max(widest[c], width(lines[l][c]));
      const auto first = static_cast<unsigned char>(lines[l][c][0]);
      left[c] = left[c] || c == 0 || (l >= kHeader && std::isalpha(first) != 0);
    }
  }
  const auto shown = columns - static_cast<std::size_t>(std::ranges::count(widest, 0U));
  if (!table.title.empty()) out << table.title << "\n\n";
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::string text;
    for (std::size_t c = 0; c < columns; ++c) {
      if (widest[c] == 0) continue;
      const std::string padding(widest[c] - width(lines[l][c]), ' ');
      if (!text.empty()) text.append(kBetweenColumns, ' ');
      text += left[c] ? lines[l][c] + padding : padding + lines[l][c];
    }
    text.erase(text.find_last_not_of(' ') + 1);
    if (text.empty()) continue;
    out << text << '\n';
    if (l + 1 == kHeader) {
      out << std::string(std::reduce(widest.begin(), widest.end()) + kBetweenColumns * (shown - 1), '-')
          << '\n';
    }
  }
  return out;
}

std::string csv_of(const Table& table) {
  std::string csv = joined(table.header, ",") + "\n";
  for (const std::vector<Value>& row : table.rows) {
    for (const Value& value : row) csv += csv_field(value.text()) + ",";
    csv.back() = '\n';
  }
  return csv;
}

nlohmann::json json_of(const Table& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const std::vector<Value>& row : table.rows) {
    nlohmann::json& object = rows.emplace_back(nlohmann::json::object());
    for (std::size_t i = 0; i < row.size(); ++i) object[table.header[i]] = row[i].data();
  }
  return rows;
}

nlohmann::json columns_and_rows(const Table& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const std::vector<Value>& row : table.rows) {
    nlohmann::json& cells = rows.emplace_back(nlohmann::json::array());
    for (const Value& value : row) cells.push_back(value.data());
  }
  return {{"columns", table.header}, {"rows", rows}};
}

std::string markdown_of(const Table& table, const std::vector<std::size_t>& numbers) {
  std::vector<std::string> alignment(table.header.size(), "---");
  for (const std::size_t column : numbers) alignment[column] = "---:";
  std::string page = "| " + joined(table.header, " | ") + " |\n| " + joined(alignment, " | ") + " |\n";
  for (const std::vector<Value>& row : table.rows) {
    page += "|";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const bool is_number = std::ranges::count(numbers, c) > 0;
      page += " " + (is_number ? row[c].text() : markdown(row[c].text())) + " |";
    }
    page += "\n";
  }
  return page;
}

}  // namespace hotpath::program
