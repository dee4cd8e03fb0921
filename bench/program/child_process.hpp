// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// What a child process runs, and where its streams lead; by default to ours.
struct ChildOptions {
  std::vector<std::string> words = {};    ///< Program (found along PATH) and arguments.
  std::optional<std::string> input = {};  ///< Its standard input.
  bool capture_errors = false;            ///< Its standard error is for errors().
  std::filesystem::path log = {};         ///< If not empty: the file of its standard output and error.
  bool own_group = false;                 ///< So that kill_group() ends all that it starts, too.
};

/// Another program that runs beside this one.
class ChildProcess {
 public:
  /// Starts it. Throws RunError.
  explicit ChildProcess(const ChildOptions& options);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it still runs.
  ~ChildProcess();

  pid_t id() const { return id_; }

  /// Reads its standard error to the end; for a process whose errors are captured.
  std::string errors();
  /// Waits for its end. Returns its status, as waitpid() gives it.
  int wait();
  /// The same for at most `time_out`; none: it still runs.
  std::optional<int> wait(Duration time_out);
  /// Kills it and, if it has a group, all that it started, and waits for their end, at most two seconds.
  void kill_group();

 private:
  const bool own_group_;
  pid_t id_ = -1;
  int errors_ = -1;  ///< Our end of the pipe; -1: none.
  std::optional<int> status_;
};

/// `ended in order`, `ended with exit code 3`, or `was ended by a signal (Killed)`, of a status as waitpid()
/// gives it.
std::string how_it_ended(int status);

/// Whether the process ended by itself with this exit code.
bool exited_with(int status, int code);

}  // namespace hotpath
