// SPDX-License-Identifier: Apache-2.0
#include "watch/chain_explanation.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "hotpath_watch_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw program::RunError(
        program::concat("no folder in ", fs::temp_directory_path().string(), ": ", std::strerror(errno)));
  return name;
}

/// Runs a command of hotpath, whose output goes to the file.
void run(const fs::path& output, std::vector<std::string> words) {
  const int file = open(output.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  dup2(file, STDOUT_FILENO);
  words.insert(words.begin(), program::own_program());
  const program::ProgramEnd end = program::run_program(std::move(words));
  if (!program::exited_with(end.status, 0)) throw program::RunError(end.errors);
}

}  // namespace

ChainExplanation::Folder::Folder() : path(new_folder()) {}

ChainExplanation::Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

ChainExplanation::ChainExplanation(const FlightRecorder& recorder, const std::string& chain)
    : task_([&] {
        const fs::path &folder = folder_.path, trace = folder / "trace", imported = folder / "imported";
        setenv("HOTPATH_FIGURES", "none", 1);
        dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
        recorder.write(trace);
        run(folder / "said", {"import", "ctf", trace, "--output", imported, "--chain", chain});
        run(folder / "text", {"explain", imported / "run"});
      }) {}

std::optional<std::vector<std::string>> ChainExplanation::lines() {
  const std::optional<std::string>& error = task_.result();
  if (!error) return std::nullopt;
  std::ifstream file(folder_.path / "text");
  std::istringstream failure(*error);
  std::vector<std::string> lines;
  for (std::string line; std::getline(error->empty() ? static_cast<std::istream&>(file) : failure, line);)
    lines.push_back(line);
  return lines;
}

}  // namespace hotpath::watch
