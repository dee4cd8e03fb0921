// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace hotpath::watch {

/// The variables with which programs run with the sensor, so that `hotpath watch` can attach to them:
/// `NAME=VALUE`, one a line. Throws RunError.
[[nodiscard]] std::string attachable_environment();

/// A program that runs with the sensor. It keeps running if the watcher is killed.
class WatchedProgram {
 public:
  /// Starts the program, found along PATH, with its arguments. Its standard output goes to standard
  /// error, because the watcher writes to standard output. Throws RunError if it cannot be started.
  WatchedProgram(std::vector<std::string> words, const std::string& session);
  WatchedProgram(const WatchedProgram&) = delete;
  WatchedProgram& operator=(const WatchedProgram&) = delete;
  /// Kills it if it still runs.
  ~WatchedProgram();

  /// The status as from waitpid(), once it has ended; the first call after the end waits for it.
  [[nodiscard]] std::optional<int> ended();
  void signal(int number) const;

 private:
  pid_t id_ = -1;
  std::optional<int> status_;
};

}  // namespace hotpath::watch
