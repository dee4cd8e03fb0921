// SPDX-License-Identifier: Apache-2.0
#include "program/csv_rows.hpp"

#include <charconv>
#include <fstream>
#include <sstream>

#include "program/errors.hpp"

namespace hotpath {

namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  if (line.ends_with(',')) fields.emplace_back();
  return fields;
}

}  // namespace

const std::string& CsvRow::text(const std::string& column) const {
  const auto found = fields_.find(column);
  if (found == fields_.end()) throw UsageError(where_ + ": there is no column `" + column + "`");
  return found->second;
}

double CsvRow::number(const std::string& column) const {
  const std::string& field = text(column);
  double value = 0;
  const char* const end = field.data() + field.size();
  const auto parsed = std::from_chars(field.data(), end, value);
  if (parsed.ec != std::errc{} || parsed.ptr != end) {
    throw UsageError(where_ + ": column `" + column + "` is not a number: `" + field + "`");
  }
  return value;
}

std::vector<CsvRow> read_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line)) throw UsageError(file.string() + " cannot be read");
  const std::vector<std::string> header = split(line);
  std::vector<CsvRow> rows;
  for (int number = 2; std::getline(in, line); ++number) {
    const std::vector<std::string> fields = split(line);
    std::map<std::string, std::string> by_name;
    for (std::size_t i = 0; i < std::min(header.size(), fields.size()); ++i) by_name[header[i]] = fields[i];
    rows.emplace_back(file.string() + ":" + std::to_string(number), std::move(by_name));
  }
  return rows;
}

}  // namespace hotpath
