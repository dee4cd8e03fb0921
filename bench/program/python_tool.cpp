// SPDX-License-Identifier: Apache-2.0
#include "program/python_tool.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string_view>

#include "program/errors.hpp"

extern char** environ;

namespace hotpath {

namespace {

/// The scripts' exit code for input that cannot be drawn.
constexpr int kUnfitInput = 2;

std::filesystem::path find_script(const std::string& script) {
  std::istringstream folders(HOTPATH_PLOT_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (std::filesystem::exists(std::filesystem::path(folder) / script))
      return std::filesystem::path(folder) / script;
  }
  return {};
}

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> block;
  for (;;) {
    const ssize_t n = read(descriptor, block.data(), block.size());
    if (n > 0) {
      text.append(block.data(), static_cast<std::size_t>(n));
    } else if (n == 0 || errno != EINTR) {
      return text;
    }
  }
}

/// Exit status and standard error of `python3 SCRIPT ARGUMENTS`.
std::pair<int, std::string> run_python(std::string script, std::vector<std::string> words) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {-1, ""};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::string python = "/usr/bin/python3";
  std::vector<char*> arguments = {python.data(), script.data()};
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t pid = 0;
  const int refused = posix_spawn(&pid, python.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  const std::string errors = read_all(ends[0]);
  close(ends[0]);
  int status = -1;
  while (refused == 0 && waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return {status, errors};
}

/// Of a Python program's complaints the last line says what went wrong.
std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

void draw_figure(const std::string& script, const std::filesystem::path& folder) {
  const char* const wanted = std::getenv("HOTPATH_FIGURES");
  if (wanted != nullptr && std::string_view(wanted) == "none") return;
  std::cout << std::flush;  // what the script prints comes after what we have printed
  const auto [status, errors] = run_python(find_script(script), {folder.string()});
  if (status == 0) return;
  const std::string cause = last_line(errors);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kUnfitInput) {
    std::cerr << "note: no figure: " << cause << "\n";
    return;
  }
  std::cerr << "note: the figure was not drawn" << (cause.empty() ? "" : " (" + cause + ")")
            << "; it needs Debian's python3-matplotlib and the script " << script << ".\n";
}

void require_script(const std::string& script, const std::vector<std::string>& arguments,
                    const std::string& failure, const std::string& needs) {
  std::cout << std::flush;
  const auto [status, errors] = run_python(find_script(script), arguments);
  if (status == 0) return;
  const std::string cause = last_line(errors);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kUnfitInput) throw UsageError(cause);
  throw RunError(failure + (cause.empty() ? "" : " (" + cause + ")") + "; it needs Debian's " + needs +
                 " and the script " + script);
}

void require_figure(const std::string& script, const std::vector<std::string>& arguments) {
  require_script(script, arguments, "the figure was not drawn", "python3-matplotlib");
}

}  // namespace hotpath
