// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "program/whole_file.hpp"
#include "sweep/design.hpp"

namespace hotpath::sweep {

/// The folder of a running sweep. Each cell's rows are on disk soon after they were computed, so
/// that a sweep continues after a kill or a full disk. Files: sweep.yaml (a copy), sweep.json
/// (version, build, cells), cells.journal (a line with a checksum for each finished cell),
/// table.csv (once all cells are finished). The journal is locked: a folder has one sweep at a
/// time. Damaged lines are ignored.
class Journal {
 public:
  /// Creates the folder, or continues the sweep in it. Throws UsageError if the folder belongs to
  /// another sweep file, to another build, or to a running process.
  Journal(std::filesystem::path folder, const Design& design);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Notes for the user about the existing folder, mainly damage.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Unfinished cells, in order.
  [[nodiscard]] std::vector<std::uint64_t> missing() const;
  /// Number of cells on disk.
  [[nodiscard]] std::size_t done() const { return done_; }

  /// Stores a cell's rows, as JSON. Throws RunError if they cannot be written; earlier cells stay.
  void add(std::uint64_t cell, const std::string& rows);
  /// Syncs all rows to disk.
  void flush();

  /// Writes table.csv, and into sweep.json columns and rows: of all cells in the order of their numbers.
  void write_table(const std::vector<std::string>& columns) const;

 private:
  void open();
  void read_back();
  [[noreturn]] void fail(int error) const;

  std::filesystem::path folder_, file_;
  std::uint64_t cells_;
  std::map<std::uint64_t, std::string> rows_;  ///< Of the finished cells, also those not yet on disk.
  std::size_t done_ = 0;
  std::optional<program::FileStream> out_;  ///< Locked.
  std::vector<std::string> notes_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
};

}  // namespace hotpath::sweep
