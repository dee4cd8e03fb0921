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
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// `over-` and `written` are one word, `CPU us/` and `callback` one fraction, the rest two words.
std::string one_line(const std::string& upper, const std::string& lower) {
  if (upper.empty()) return lower;
  if (upper.back() == '-') return upper.substr(0, upper.size() - 1) + lower;
  return upper.back() == '/' ? upper + lower : upper + " " + lower;
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
  return column == 0 || std::any_of(rows_.begin(), rows_.end(), is_word);
}

std::vector<std::size_t> TextTable::widths() const {
  std::vector<std::size_t> widest(header_.size());
  const auto widen = [&](const std::vector<Cell>& row) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      widest[c] = std::max({widest[c], width(row[c].value), width(row[c].below)});
    }
  };
  widen(header_);
  std::for_each(rows_.begin(), rows_.end(), widen);
  return widest;
}

void TextTable::write_line(std::ostream& out, const std::vector<Cell>& row, std::string Cell::*of) const {
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

void TextTable::write_plain(std::ostream& out) const {
  const auto any = [](const std::vector<Cell>& row, std::string Cell::*line) {
    return std::any_of(row.begin(), row.end(), [&](const Cell& cell) { return !(cell.*line).empty(); });
  };
  if (!title_.empty()) out << title_ << "\n\n";
  if (any(header_, &Cell::value)) write_line(out, header_, &Cell::value);
  if (any(header_, &Cell::below)) {
    write_line(out, header_, &Cell::below);
    std::size_t total = 0;
    for (const std::size_t characters : widths()) {
      if (characters > 0) total += characters + (total > 0 ? kBetweenColumns : 0);
    }
    out << std::string(total, '-') << '\n';
  }
  for (const auto& row : rows_) {
    write_line(out, row, &Cell::value);
    if (any(row, &Cell::below)) write_line(out, row, &Cell::below);
  }
}

void TextTable::write_markdown(std::ostream& out) const {
  out << "**" << title_ << "**\n\n";
  for (const Cell& h : header_) out << "| " << one_line(h.value, h.below) << ' ';
  out << "|\n";
  for (std::size_t c = 0; c < header_.size(); ++c) out << (left_aligned(c) ? "| --- " : "| ---: ");
  out << "|\n";
  for (const auto& row : rows_) {
    for (const Cell& cell : row) {
      out << "| " << (cell.below.empty() ? cell.value : cell.value + " " + cell.below) << ' ';
    }
    out << "|\n";
  }
}

std::ostream& operator<<(std::ostream& out, const TextTable& table) {
  table.write_plain(out);
  return out;
}

}  // namespace hotpath
