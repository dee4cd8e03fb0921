// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <exception>
#include <iostream>

#include "hotpath/core/trace.hpp"
#include "program/whole_file.hpp"
#include "results/run_record.hpp"

namespace hotpath::results {

/// The folder of one run. Files get their names when they are complete. Until then jobs.csv and
/// chains.csv grow under names that end in `.part`, from which recover_run() recovers a killed run.
class RunFolder {
 public:
  /// Creates the folder. Throws UsageError if it cannot be written or is not empty.
  explicit RunFolder(const std::filesystem::path& path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// A descriptor that locks the run in this folder; negative: the run is still running, or has no
  /// jobs.csv.part.
  [[nodiscard]] static int lock(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  /// Replaces a file. Throws RunError (disk full, for example) and then leaves the old file.
  void write(const std::string& name, const program::FileContent& content) const;

  /// Appends one repetition to jobs.csv and chains.csv and syncs its rows, so that run.json may
  /// list it. Throws RunError.
  void append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace);

  /// Gives jobs.csv and chains.csv their final names. Throws RunError.
  void finish();

  /// Ends the run: finish(), then summary.json, then `record` as run.json, which is complete unless
  /// the run is partial or has failures. Throws RunError.
  void close(RunRecord& record, const nlohmann::json& summary);

  /// Calls `print` to show the results, and prints the folder. A failure affects no result and is
  /// only a note.
  void show(const auto& print) const {
    try {
      print();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "note: the result is stored, but could not be shown: %s\n", error.what());
    }
    std::cout << "\nResults: " << path_.c_str() << "\n" << std::flush;
  }

 private:
  /// Resets `complete` if it throws: the new file may already have its name although it could not
  /// be synced.
  void conclude(RunRecord& record) const;
  [[noreturn]] void fail(const std::string& name, int cause) const;

  const std::filesystem::path path_;
  program::FileStream jobs_, chains_;
  int lock_ = -1;
};

}  // namespace hotpath::results
