// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <exception>
#include <iostream>

#include "hotpath/core/trace.hpp"
#include "program/whole_file.hpp"

namespace hotpath {

/// The folder of one run. Files get their names when they are whole: until then jobs.csv and chains.csv grow
/// under names that end in `.part`, which are all that a killed run leaves of them (recover_run()).
class RunFolder {
 public:
  /// Creates the folder. Throws UsageError when it cannot be written or holds anything already.
  explicit RunFolder(const std::filesystem::path& path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// A descriptor that holds the lock of the run in this folder; negative: it still goes on.
  [[nodiscard]] static int lock(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  /// Replaces a whole file. Throws RunError (disk full, for example), and leaves the old one.
  void write(const std::string& name, const FileContent& content) const;

  /// Writes run.json for the last time. Throws RunError, and takes back then that the run is complete: the
  /// file may have its name already, without the disk's word that it stays.
  void conclude(nlohmann::json facts) const;

  /// Adds one repetition to jobs.csv and chains.csv, and waits until its rows are on disk: run.json may name
  /// it from then on. Throws RunError.
  void append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace);

  /// Gives jobs.csv and chains.csv their names. Throws RunError.
  void finish();

  /// Lets `print` show what was stored, and names the folder. What fails then changes no result, and is a
  /// note.
  void show(const auto& print) const {
    try {
      print();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "note: the result is stored, and could not be shown: %s\n", error.what());
    }
    std::cout << "\nResults: " << path_.c_str() << "\n" << std::flush;
  }

 private:
  [[noreturn]] void fail(const std::string& name, int cause) const;

  const std::filesystem::path path_;
  FileStream jobs_, chains_;
  int lock_ = -1;
};

}  // namespace hotpath
