// SPDX-License-Identifier: Apache-2.0
#include "program/python_tool.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <sstream>
#include <string_view>
#include <utility>

#include "program/child_process.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// The package's exit code for input that it cannot use.
constexpr int kUnfitInput = 2;

/// The folder of the package: the source tree's, or that of the installation.
fs::path package_folder() {
  std::istringstream folders(HOTPATH_PYTHON_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (fs::exists(fs::path(folder) / "hotpath_report")) return folder;
  }
  throw RunError("the Python package hotpath_report is in none of " HOTPATH_PYTHON_DIRS
                 "; build and install hotpath anew");
}

/// A command line of the package, for which this process's environment is prepared. Python is isolated (-I):
/// neither a file of the current folder nor PYTHONPATH and the like decide what runs.
std::vector<std::string> command_line(const std::string& command, const std::vector<std::string>& arguments) {
  std::cout << std::flush;  // what the package prints comes after what we have printed
  std::fflush(stdout);
  setenv("HOTPATH", own_program().c_str(), 1);
  const fs::path program = package_folder() / "hotpath_report" / "__main__.py";
  std::vector<std::string> words = {"/usr/bin/python3", "-I", "-B", program.string(), command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

}  // namespace

void become_python_tool(const std::string& command, const std::vector<std::string>& arguments) {
  std::vector<std::string> words = command_line(command, arguments);
  execv(words.front().c_str(), argument_list(words).data());
  throw RunError(words.front() + " could not be started (" + std::strerror(errno) + ")");
}

void draw_figure(const std::string& command, const fs::path& folder) {
  const char* const wanted = std::getenv("HOTPATH_FIGURES");
  if (wanted != nullptr && std::string_view(wanted) == "none") return;
  ProgramEnd end;
  try {
    end = run_program(command_line(command, {folder.string()}));
  } catch (const std::exception& error) {  // the result is whole without it
    std::cerr << "note: the figure was not drawn: " << error.what() << "\n";
    return;
  }
  auto [status, errors] = std::move(end);
  if (exited_with(status, 0)) return;
  while (errors.ends_with('\n')) errors.pop_back();
  // The last line says what went wrong.
  std::cerr << (exited_with(status, kUnfitInput) ? "note: no figure: " : "note: the figure was not drawn: ")
            << errors.substr(errors.rfind('\n') + 1) << "\n";
}

}  // namespace hotpath
