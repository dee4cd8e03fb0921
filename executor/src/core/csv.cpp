// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/csv.hpp"

#include <algorithm>
#include <fstream>

namespace hotpath {

namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& file, CsvLayout layout)
    : file_(std::make_unique<std::ifstream>(open_input(file, "give the path of a readable CSV file"))),
      lines_(*file_, file.string()),
      layout_(layout) {
  if (read_line()) header_.assign(fields_.begin(), fields_.end());
}

CsvReader::CsvReader(LineReader lines, CsvLayout layout, std::vector<std::string> columns)
    : lines_(std::move(lines)), layout_(layout), header_(std::move(columns)) {
  if (!read_line()) return;
  first_line_is_row_ = !header_.empty() && fields_.front() != header_.front();
  if (!first_line_is_row_) header_.assign(fields_.begin(), fields_.end());
}

void CsvReader::require_header(std::string_view expected) const {
  if (joined(header_, ",") != expected) {
    throw InputError(lines_.file(), 1, "the header must be `" + std::string(expected) + "`",
                     "give a file of the right kind");
  }
}

std::optional<std::size_t> CsvReader::find_column(std::string_view name) const {
  const auto place = std::find(header_.begin(), header_.end(), name);
  if (place == header_.end()) return std::nullopt;
  return static_cast<std::size_t>(place - header_.begin());
}

std::size_t CsvReader::column(std::string_view name) const {
  if (const auto index = find_column(name)) return *index;
  throw InputError(lines_.file(), 1, "there is no column `" + std::string(name) + "`",
                   "name it in the header");
}

bool CsvReader::next() {
  if (first_line_is_row_) {
    first_line_is_row_ = false;
  } else if (!read_line()) {
    return false;
  }
  constexpr const char* kRemedy = "give one field for each column";
  const std::size_t columns = header_.size();
  if (fields_.size() > columns) fail(concat("more than ", columns, " columns"), kRemedy);
  if (fields_.size() < columns) fail(concat(fields_.size(), " columns instead of ", columns), kRemedy);
  return true;
}

bool CsvReader::read_line() {
  do {
    if (!lines_.next()) return false;
  } while (layout_ == CsvLayout::by_hand && trimmed(lines_.text()).empty());
  const std::string_view line = lines_.text();
  fields_.clear();
  for (std::size_t from = 0;;) {
    const std::size_t comma = std::min(line.find(',', from), line.size());
    const std::string_view field = line.substr(from, comma - from);
    fields_.push_back(layout_ == CsvLayout::by_hand ? trimmed(field) : field);
    if (comma == line.size()) return true;
    from = comma + 1;
  }
}

Duration CsvReader::nanoseconds(std::size_t column) const {
  const Duration value(number<std::int64_t>(column));
  if (value > kLongest || value < -kLongest) fail_number(column, "whole number");
  return value;
}

void CsvReader::fail(const std::string& problem, const std::string& remedy) const {
  throw InputError(lines_.file(), static_cast<std::int64_t>(line()), problem, remedy);
}

void CsvReader::fail_number(std::size_t column, const char* kind) const {
  fail(concat("column ", column + 1, " (", header_[column], ") is `", text(column), "`"),
       concat("give a ", kind, " in range"));
}

}  // namespace hotpath
