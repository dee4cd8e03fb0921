// SPDX-License-Identifier: Apache-2.0
#include "program/text_table.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <ostream>

namespace hotpath::program {

namespace {

constexpr std::size_t kBetweenColumns = 2;

/// Number of UTF-8 characters: all bytes except continuation bytes.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

bool is_word(const std::string& text) {
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
}

}  // namespace

TextTable::TextTable(std::string title, const std::vector<std::string>& header)
    : title_(std::move(title)), header_(2) {
  for (const std::string& text : header) {
    const std::size_t end = text.find('\n');
    header_[0].push_back(end == std::string::npos ? "" : text.substr(0, end));
    header_[1].push_back(text.substr(end == std::string::npos ? 0 : end + 1));
  }
}

void TextTable::add_row(const std::vector<Cell>& cells) {
  for (const auto of : {&Cell::value, &Cell::below}) {
    Line& line = lines_.emplace_back();
    for (const Cell& cell : cells) line.push_back(cell.*of);
  }
}

std::ostream& operator<<(std::ostream& out, const TextTable& table) {
  const std::size_t columns = table.header_[1].size();
  std::vector<std::size_t> widest(columns);
  std::vector<bool> left(columns);  // alignment: the first column and columns with words
  for (std::size_t c = 0; c < columns; ++c) {
    left[c] = c == 0;
    for (const TextTable::Line& line : table.header_) widest[c] = std::max(widest[c], width(line[c]));
    for (const TextTable::Line& line : table.lines_) {
      widest[c] = std::max(widest[c], width(line[c]));
      left[c] = left[c] || is_word(line[c]);
    }
  }
  const auto write = [&](const TextTable::Line& line) {
    std::string text;
    for (std::size_t c = 0; c < columns; ++c) {
      if (widest[c] == 0) continue;
      const std::string padding(widest[c] - width(line[c]), ' ');
      if (!text.empty()) text.append(kBetweenColumns, ' ');
      text += left[c] ? line[c] + padding : padding + line[c];
    }
    text.erase(text.find_last_not_of(' ') + 1);
    if (!text.empty()) out << text << '\n';
    return !text.empty();
  };
  if (!table.title_.empty()) out << table.title_ << "\n\n";
  write(table.header_[0]);
  if (write(table.header_[1])) {
    const auto shown = columns - static_cast<std::size_t>(std::ranges::count(widest, 0U));
    out << std::string(std::reduce(widest.begin(), widest.end()) + kBetweenColumns * (shown - 1), '-')
        << '\n';
  }
  std::ranges::for_each(table.lines_, write);
  return out;
}

}  // namespace hotpath::program
