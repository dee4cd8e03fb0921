// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sweep/design.hpp"

namespace hotpath {

/// The folder of a sweep while it runs: each cell's rows are on disk soon after they were computed, so that a
/// sweep that was killed, or whose disk was full, goes on where it was. Files: sweep.yaml (a copy),
/// sweep.json (version, build, cells), cells.journal (a line with a checksum for each cell that is done),
/// table.csv (when all are). The journal is locked: a folder has one sweep at a time. A line that is not as
/// it was written counts as none.
class SweepJournal {
 public:
  /// Creates the folder, or takes up what is in it. Throws UsageError for one of another sweep file or of
  /// another build, or on which another process works.
  SweepJournal(std::filesystem::path folder, const SweepDesign& design);
  ~SweepJournal();
  SweepJournal(const SweepJournal&) = delete;
  SweepJournal& operator=(const SweepJournal&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// What the user should know of what was found there: damage, above all.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Cells that are not done, in order.
  [[nodiscard]] std::vector<std::uint64_t> missing() const;
  /// Cells that are safely on the disk.
  [[nodiscard]] std::size_t done() const { return done_; }

  /// Keeps a cell's rows. Throws RunError where they cannot be written; what was kept before stays.
  void add(std::uint64_t cell, const std::string& rows);
  /// Forces all to the disk.
  void flush();

  /// Writes table.csv: the header, then the rows of all cells in the order of their numbers.
  void write_table(const std::string& header);

 private:
  /// Delegated to, so that the destructor unlocks whatever the public constructor throws.
  SweepJournal(std::filesystem::path folder, std::uint64_t cells);
  void open();
  void read_back();
  [[noreturn]] void fail() const;
  [[noreturn]] void fail_reading() const;
  [[noreturn]] void fail_damaged() const;

  std::filesystem::path folder_, file_;
  std::vector<bool> is_done_;
  std::size_t done_ = 0, pending_cells_ = 0;
  int descriptor_ = -1;
  std::string pending_;
  std::vector<std::string> notes_;
  std::chrono::steady_clock::time_point flushed_ = std::chrono::steady_clock::now();
};

}  // namespace hotpath
