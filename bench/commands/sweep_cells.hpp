// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sweep/design.hpp"

namespace hotpath {

/// The cells of a sweep: each a call of the command that the sweep is about, and rows of its table.
class SweepCells {
 public:
  /// Run folders are kept below `output`. Throws InputError, with its line, for an option that the command
  /// would refuse.
  SweepCells(SweepDesign design, std::filesystem::path output);

  const SweepDesign& design() const { return design_; }
  bool live() const { return design_.command == "run"; }

  /// The names of the table's columns.
  [[nodiscard]] std::string header() const;
  /// The table's rows of one cell. One that overloads the system or fails has one row that says why. Throws
  /// UsageError for what the command refuses, RunError after Ctrl-C.
  [[nodiscard]] std::string rows_of(std::uint64_t cell) const;

 private:
  void check_cell(const std::vector<SweepOption>& at, int line) const;
  /// The command line of a cell with these coordinates, after the command.
  std::vector<std::string> words_of(const std::vector<SweepOption>& at, std::uint64_t cell) const;
  /// The columns of a cell, the same in each of its rows. What schedules the graph has a column anyway.
  std::string place_of(std::uint64_t cell) const;
  std::string failed(std::uint64_t cell, const std::string& place, const std::string& why) const;
  std::filesystem::path folder_of(std::uint64_t cell) const;
  /// The axes' values, for messages.
  std::string named(std::uint64_t cell) const;
  std::string measured_of(std::uint64_t cell, const std::string& place) const;
  std::string bounds_of(std::uint64_t cell, const std::string& place) const;
  /// Runs a cell in a process of its own, which leaves its results in files.
  void run_as_child(std::uint64_t cell, const std::string& results) const;

  SweepDesign design_;
  std::filesystem::path output_;
};

}  // namespace hotpath
