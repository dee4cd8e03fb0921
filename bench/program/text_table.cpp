// SPDX-License-Identifier: Apache-2.0
#include "program/text_table.hpp"

#include <algorithm>
#include <cctype>
#include <ostream>

namespace hotpath {

namespace {

constexpr std::size_t kBetweenColumns = 2;

/// Characters of UTF-8: all bytes but those that continue one.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

TextTable::TextTable(std::string title, std::vector<std::string> header) : title_(std::move(title)) {
  for (const std::string& text : header) {
    const std::size_t end = text.find('\n');
    header_.push_back(end == std::string::npos ? Cell("", text)
                                               : Cell(text.substr(0, end), text.substr(end + 1)));
  }
}

bool TextTable::left_aligned(std::size_t column) const {
  const auto is_word = [&](const std::vector<Cell>& row) {
    const std::string& value = row[column].value;
    return !value.empty() && std::isalpha(static_cast<unsigned char>(value.front())) != 0;
  };
  return column == 0 || std::ranges::any_of(rows_, is_word);
}

std::vector<std::size_t> TextTable::widths() const {
  std::vector<std::size_t> widest(header_.size());
  const auto widen = [&](const std::vector<Cell>& row) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      widest[c] = std::max({widest[c], width(row[c].value), width(row[c].below)});
    }
  };
  widen(header_);
  std::ranges::for_each(rows_, widen);
  return widest;
}

void TextTable::write_line(std::ostream& out, const std::vector<Cell>& row, std::string Cell::*of) const {
  if (std::ranges::all_of(row, [&](const Cell& cell) { return (cell.*of).empty(); })) return;
  const std::vector<std::size_t> widest = widths();
  std::string line;
  for (std::size_t c = 0; c < header_.size(); ++c) {
    if (widest[c] == 0) continue;
    const std::string& content = row[c].*of;
    const std::string padding(widest[c] - width(content), ' ');
    if (!line.empty()) line.append(kBetweenColumns, ' ');
    line += left_aligned(c) ? content + padding : padding + content;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  out << line << '\n';
}

std::ostream& operator<<(std::ostream& out, const TextTable& table) {
  if (!table.title_.empty()) out << table.title_ << "\n\n";
  table.write_line(out, table.header_, &TextTable::Cell::value);
  table.write_line(out, table.header_, &TextTable::Cell::below);
  if (std::ranges::any_of(table.header_, [](const TextTable::Cell& cell) { return !cell.below.empty(); })) {
    std::size_t total = 0;
    for (const std::size_t characters : table.widths()) {
      if (characters > 0) total += characters + (total > 0 ? kBetweenColumns : 0);
    }
    out << std::string(total, '-') << '\n';
  }
  for (const auto& row : table.rows_) {
    table.write_line(out, row, &TextTable::Cell::value);
    table.write_line(out, row, &TextTable::Cell::below);
  }
  return out;
}

}  // namespace hotpath
