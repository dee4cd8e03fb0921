// SPDX-License-Identifier: Apache-2.0
#include "watch/watched_program.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <utility>

#include "hotpath/sensor/ring.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/new_files.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;

/// Beside the installed command, or in the build tree.
std::string sensor_library() {
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

const std::string kPreload = "LD_PRELOAD=", kSession = std::string(sensor::kSessionVariable) + "=";

/// The variables of the sensor; other preloaded libraries stay.
std::vector<std::string> sensor_variables(const std::string& library, const std::string& session) {
  const char* const others = std::getenv("LD_PRELOAD");
  std::string rest = others == nullptr || *others == '\0' ? "" : ":" + std::string(others);
  std::ranges::replace(rest, ' ', ':');  // a shell splits `env $(...)` at blanks
  return {kPreload + library + rest, kSession + session};
}

std::vector<std::string> environment_with(const std::string& library, const std::string& session) {
  std::vector<std::string> words;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string word = *variable;
    if (!word.starts_with(kPreload) && !word.starts_with(kSession)) words.push_back(word);
  }
  std::ranges::copy(sensor_variables(library, session), std::back_inserter(words));
  return words;
}

}  // namespace

std::string attachable_environment() {
  std::string lines;
  for (const std::string& variable : sensor_variables(sensor_library(), sensor::kAttachable))
    lines += variable + "\n";
  return lines;
}

WatchedProgram::WatchedProgram(std::vector<std::string> words, const std::string& session) {
  std::vector<std::string> environment = environment_with(sensor_library(), session);
  const auto prepare = [] {
    std::signal(SIGPIPE, SIG_DFL);  // this program ignores both
    std::signal(SIGXFSZ, SIG_DFL);
    umask(program::inherited_umask);
    dup2(STDERR_FILENO, STDOUT_FILENO);
  };
  id_ = program::start_program(std::move(words), prepare, program::argument_list(environment).data());
}

WatchedProgram::~WatchedProgram() {
  if (ended()) return;
  signal(SIGKILL);
  int status = 0;
  program::await_process(id_, &status);
}

std::optional<int> WatchedProgram::ended() {
  int status = 0;
  if (!status_ && program::await_process(id_, &status, WNOHANG) == id_) status_ = status;
  return status_;
}

void WatchedProgram::signal(int number) const {
  if (!status_) kill(id_, number);
}

}  // namespace hotpath::watch
