// SPDX-License-Identifier: Apache-2.0
#include "program/python_tool.hpp"

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string_view>
#include <utility>

#include "program/child_process.hpp"
#include "program/errors.hpp"

namespace hotpath::program {

namespace {

namespace fs = std::filesystem;

/// The folder of the package, in the source tree or the installation.
fs::path package_folder() {
  std::istringstream folders(HOTPATH_PYTHON_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (fs::exists(fs::path(folder) / "hotpath_report")) return folder;
  }
  throw RunError("the Python package hotpath_report is in none of " HOTPATH_PYTHON_DIRS
                 "; rebuild and reinstall hotpath");
}

/// A command line of the package; sets HOTPATH in the environment for it. Python is isolated (-I),
/// so that neither files in the current folder nor PYTHONPATH change the program.
std::vector<std::string> command_line(const std::string& command, const std::vector<std::string>& arguments) {
  std::cout << std::flush;  // our output precedes the package's output
  std::fflush(stdout);
  setenv("HOTPATH", own_program().c_str(), 1);
  const std::string program = package_folder().string();  // has a __main__.py and the package
  std::vector<std::string> words = {"/usr/bin/python3", "-I", "-B", program, command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

}  // namespace

void become_python_tool(const std::string& command, const std::vector<std::string>& arguments) {
  become(command_line(command, arguments));
}

void call_python_tool(const std::string& command, const std::vector<std::string>& arguments) {
  const auto [status, message] = run_program(command_line(command, arguments));
  if (exited_with(status, 0)) return;
  if (exited_with(status, 2)) throw UsageError(message);  // unusable input
  throw RunError(message);
}

void draw_figure(const std::string& command, const fs::path& folder, bool is_page) {
  const char* const figures = std::getenv("HOTPATH_FIGURES");
  if (!is_page && figures != nullptr && std::string_view(figures) == "none") return;
  try {
    call_python_tool(command, {folder.string()});
  } catch (const UsageError& error) {
    std::cerr << "note: no figure: " << error.what() << "\n";
  } catch (const std::exception& error) {  // the result is complete without the figure
    std::cerr << "note: the figure was not drawn: " << error.what() << "\n";
  }
}

}  // namespace hotpath::program
