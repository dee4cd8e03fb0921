// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

namespace hotpath::program {

/// A task in a child process, which has the memory of this process at the time of the fork. It is killed
/// when this process ends. For processes with one thread.
class ForkedTask {
 public:
  /// Throws RunError if no process could be created.
  explicit ForkedTask(const std::function<void()>& task);
  ForkedTask(const ForkedTask&) = delete;
  ForkedTask& operator=(const ForkedTask&) = delete;
  /// Kills it, with the programs that it started, if it still runs.
  ~ForkedTask();

  /// Why it failed, or an empty text, once it has ended. Can be asked again.
  [[nodiscard]] const std::optional<std::string>& result() { return end(false); }
  /// The same; waits for the end.
  [[nodiscard]] const std::string& wait() { return *end(true); }

 private:
  const std::optional<std::string>& end(bool wait);

  int error_ = -1;  // file in memory
  pid_t id_ = -1;
  std::optional<std::string> result_;
};

}  // namespace hotpath::program
