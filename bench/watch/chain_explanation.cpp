// SPDX-License-Identifier: Apache-2.0
#include "watch/chain_explanation.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>

#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;

/// $0: hotpath, $1: the folder, $2: the chain.
constexpr const char* kScript =
    R"(export HOTPATH_FIGURES=none
exec >"$1/said" 2>&1 </dev/null
"$0" import ctf "$1/trace" --output "$1/imported" --chain "$2" && exec "$0" explain "$1/imported/run" >"$1/text")";

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "hotpath_watch_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw program::RunError(
        program::concat("no folder in ", fs::temp_directory_path().string(), ": ", std::strerror(errno)));
  return name;
}

}  // namespace

ChainExplanation::ChainExplanation(const FlightRecorder& recorder, const std::string& chain)
    : folder_(new_folder()) {
  try {
    recorder.write(folder_ / "trace");
    id_ = program::start_program(
        {"sh", "-c", kScript, program::own_program(), folder_.string(), chain}, [] { setpgid(0, 0); },
        environ);
  } catch (...) {  // no destructor will run
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    throw;
  }
}

ChainExplanation::~ChainExplanation() {
  if (id_ > 0) {
    kill(-id_, SIGKILL);  // with the program that the shell runs
    program::await_process(id_, nullptr);
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::optional<std::vector<std::string>> ChainExplanation::lines() {
  int status = 0;
  if (program::await_process(id_, &status, WNOHANG) != id_) return std::nullopt;
  id_ = -1;
  std::ifstream file(folder_ / (program::exited_with(status, 0) ? "text" : "said"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

}  // namespace hotpath::watch
