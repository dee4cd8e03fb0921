// SPDX-License-Identifier: Apache-2.0
#include "program/python_tool.hpp"

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string_view>

#include "program/child_process.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// The package's exit code for input that it cannot use.
constexpr int kUnfitInput = 2;

/// The folder of the package: the source tree's, or that of the installation.
std::string package_folder() {
  std::istringstream folders(HOTPATH_PYTHON_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (fs::exists(fs::path(folder) / "hotpath_report")) return folder;
  }
  return "";
}

/// How the package ended, and the last line of its complaints, which says what went wrong.
struct Outcome {
  bool succeeded = false, unfit_input = false;
  std::string cause;
};

Outcome run_package(const std::string& command, const std::vector<std::string>& arguments) {
  std::cout << std::flush;  // what the package prints comes after what we have printed
  std::fflush(stdout);
  const char* const path = std::getenv("PYTHONPATH");
  ChildOptions options{
      .words = {"/usr/bin/env",
                "PYTHONPATH=" + package_folder() + (path == nullptr ? "" : std::string(":") + path),
                "HOTPATH=" + fs::read_symlink("/proc/self/exe").string(), "/usr/bin/python3", "-B", "-m",
                "hotpath_report", command},
      .capture_errors = true};
  options.words.insert(options.words.end(), arguments.begin(), arguments.end());
  ChildProcess python(options);
  std::string errors = python.errors();
  const int status = python.wait();
  while (errors.ends_with('\n')) errors.pop_back();
  return {exited_with(status, 0), exited_with(status, kUnfitInput), errors.substr(errors.rfind('\n') + 1)};
}

std::string why(const Outcome& outcome) {
  return (outcome.cause.empty() ? "" : " (" + outcome.cause + ")") +
         "; it needs Debian's python3-matplotlib, python3-scipy, python3-pandas and python3-jinja2, and "
         "hotpath's Python package hotpath_report";
}

}  // namespace

void run_python_tool(const std::string& command, const std::vector<std::string>& arguments) {
  const Outcome outcome = run_package(command, arguments);
  if (outcome.unfit_input) throw UsageError(outcome.cause);
  if (!outcome.succeeded) throw RunError(command + " failed" + why(outcome));
}

void draw_figure(const std::string& command, const fs::path& folder) {
  const char* const wanted = std::getenv("HOTPATH_FIGURES");
  if (wanted != nullptr && std::string_view(wanted) == "none") return;
  const Outcome outcome = run_package(command, {folder.string()});
  if (outcome.succeeded) return;
  std::cerr << (outcome.unfit_input ? "note: no figure: " + outcome.cause
                                    : "note: the figure was not drawn" + why(outcome))
            << "\n";
}

}  // namespace hotpath
