// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "program/table.hpp"
#include "sweep/design.hpp"

namespace hotpath::commands {

/// The cells of a sweep. Each cell is one call of the sweep's command and yields rows of the table.
class SweepCells {
 public:
  /// Run folders are kept below `output`. Throws InputError, with its line, for an option that the
  /// command rejects.
  SweepCells(sweep::Design design, std::filesystem::path output);

  const sweep::Design& design() const { return design_; }
  bool live() const { return design_.command == "run"; }

  /// The columns of the table: the cell's coordinates, without executor or deployment, which have a
  /// column of their own among the results; then the reason of a failure; then the results.
  [[nodiscard]] std::vector<std::string> columns() const;
  /// The rows of one cell, as CSV. A cell that overloads the system or fails has one row with the
  /// reason. Throws UsageError if the command rejects its options, RunError after Ctrl-C.
  [[nodiscard]] std::string rows_of(std::uint64_t cell) const;

 private:
  using Row = std::vector<program::Value>;

  void check_cell(const std::vector<sweep::Option>& at, int line) const;
  /// The command's words for a cell with these coordinates.
  std::vector<std::string> words_of(const std::vector<sweep::Option>& at, std::uint64_t cell) const;
  std::vector<Row> measured_of(std::uint64_t cell) const;
  std::vector<Row> bounds_of(std::uint64_t cell) const;

  sweep::Design design_;
  std::filesystem::path output_;
};

}  // namespace hotpath::commands
