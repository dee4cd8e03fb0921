// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace hotpath {

/// One row of a CSV file by column name.
class CsvRow {
 public:
  CsvRow(std::string where, std::map<std::string, std::string> fields)
      : where_(std::move(where)), fields_(std::move(fields)) {}
  /// Throw UsageError for a missing column or what is not a number.
  const std::string& text(const std::string& column) const;
  double number(const std::string& column) const;

 private:
  std::string where_;
  std::map<std::string, std::string> fields_;
};

/// Throws UsageError for a file that cannot be read.
std::vector<CsvRow> read_csv(const std::filesystem::path& file);

}  // namespace hotpath
