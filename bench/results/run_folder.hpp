// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>

#include "hotpath/core/trace.hpp"
#include "program/whole_file.hpp"

namespace hotpath {

/// The folder of one run. Files get their names when they are whole: until then jobs.csv and chains.csv grow
/// under names that end in `.part`, which are all that a killed run leaves of them (recover_run()).
class RunFolder {
 public:
  /// Creates the folder. Throws UsageError when it cannot be written or holds a run already.
  explicit RunFolder(const std::filesystem::path& path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// A descriptor that holds the lock of the run in this folder; negative: it still goes on.
  [[nodiscard]] static int lock(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }

  /// Replaces a whole file. Throws RunError (disk full, for example), and leaves the old one.
  void write(const std::string& name, const FileContent& content) const;

  /// Adds one repetition to jobs.csv and chains.csv, and waits until its rows are on disk: run.json may name
  /// it from then on. Throws RunError.
  void append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace);

  /// Gives jobs.csv and chains.csv their names. Throws RunError.
  void finish();

 private:
  [[noreturn]] void fail(const std::string& name, int cause) const;

  const std::filesystem::path path_;
  int lock_ = -1;
  std::ofstream jobs_, chains_;
};

}  // namespace hotpath
