// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

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

  /// The table's header.
  [[nodiscard]] std::string header() const;
  /// The rows of one cell. A cell that overloads the system or fails has one row with the reason.
  /// Throws UsageError if the command rejects its options, RunError after Ctrl-C.
  [[nodiscard]] std::string rows_of(std::uint64_t cell) const;

 private:
  void check_cell(const std::vector<sweep::Option>& at, int line) const;
  /// The arguments of the command for a cell with these coordinates.
  std::vector<std::string> words_of(const std::vector<sweep::Option>& at, std::uint64_t cell) const;
  /// The cell's coordinates, which begin each of its rows, without executor or deployment: they
  /// have a column of their own.
  std::string place_of(std::uint64_t cell) const;
  std::string failed(std::uint64_t cell, const std::string& place, const std::string& why) const;
  std::filesystem::path folder_of(std::uint64_t cell) const;
  /// The cell and its axis values, for messages.
  std::string named(std::uint64_t cell) const;
  std::string measured_of(std::uint64_t cell, const std::string& place) const;
  std::string bounds_of(std::uint64_t cell, const std::string& place) const;
  /// Runs a cell in its own process, which writes its results to files.
  void run_as_child(std::uint64_t cell, const std::string& results) const;

  sweep::Design design_;
  std::filesystem::path output_;
};

}  // namespace hotpath::commands
