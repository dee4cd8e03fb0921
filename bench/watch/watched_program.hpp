// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/new_files.hpp"

namespace hotpath::watch {

/// Beside the installed command, or in the build tree.
inline std::string sensor_library() {
  namespace fs = std::filesystem;
  const fs::path installed =
      fs::path(program::own_program()).parent_path().parent_path() / "lib" / "libhotpath_watch.so";
  std::string library = fs::exists(installed) ? installed.string() : HOTPATH_SENSOR;
  if (!fs::exists(library))
    throw program::RunError("the sensor " + library + " does not exist; install the package hotpath_sensor");
  if (library.find_first_of(" :") != std::string::npos)
    throw program::RunError("the sensor cannot be preloaded, because its path has a blank or colon: " +
                            library);
  return library;
}

/// The variables with which programs run with the sensor, and their values. Other preloaded libraries stay.
/// Throws RunError.
inline std::vector<std::pair<std::string, std::string>> sensor_variables(const std::string& session) {
  const char* const others = std::getenv("LD_PRELOAD");
  std::string rest = others == nullptr || *others == '\0' ? "" : ":" + std::string(others);
  std::ranges::replace(rest, ' ', ':');  // a shell splits `env $(...)` at blanks
  return {{"LD_PRELOAD", sensor_library() + rest}, {sensor::kSessionVariable, session}};
}

/// A program that runs with the sensor. It keeps running if the watcher is killed.
class WatchedProgram {
 public:
  /// Starts the program, found along PATH, with its arguments. Its standard output goes to standard
  /// error, because the watcher writes to standard output. Throws RunError if it cannot be started.
  WatchedProgram(std::vector<std::string> words, const std::string& session) {
    for (const auto& [name, value] : sensor_variables(session)) setenv(name.c_str(), value.c_str(), 1);
    const auto prepare = [] {
      std::signal(SIGPIPE, SIG_DFL);  // this program ignores both
      std::signal(SIGXFSZ, SIG_DFL);
      umask(program::inherited_umask);
      dup2(STDERR_FILENO, STDOUT_FILENO);
    };
    id_ = program::start_program(std::move(words), prepare, environ);
  }
  WatchedProgram(const WatchedProgram&) = delete;
  WatchedProgram& operator=(const WatchedProgram&) = delete;
  /// Kills it if it still runs.
  ~WatchedProgram() {
    if (ended()) return;
    signal(SIGKILL);
    int status = 0;
    program::await_process(id_, &status);
  }

  /// The status as from waitpid(), once it has ended; the first call after the end waits for it.
  [[nodiscard]] std::optional<int> ended() {
    int status = 0;
    if (!status_ && program::await_process(id_, &status, WNOHANG) == id_) status_ = status;
    return status_;
  }
  void signal(int number) const {
    if (!status_) kill(id_, number);
  }

 private:
  pid_t id_ = -1;
  std::optional<int> status_;
};

}  // namespace hotpath::watch
