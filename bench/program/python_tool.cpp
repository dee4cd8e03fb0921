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

/// Exit status and standard error of `python3 SCRIPT ARGUMENTS`.
std::pair<int, std::string> run_python(const std::string& script, const std::vector<std::string>& arguments) {
  std::cout << std::flush;  // what the script prints comes after what we have printed
  std::fflush(stdout);
  ChildOptions options{.words = {"/usr/bin/python3", script}, .capture_errors = true};
  options.words.insert(options.words.end(), arguments.begin(), arguments.end());
  ChildProcess python(options);
  std::string errors = python.errors();
  return {python.wait(), std::move(errors)};
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
  const auto [status, errors] = run_python(find_script(script), {folder.string()});
  if (status == 0) return;
  const std::string cause = last_line(errors);
  if (exited_with(status, kUnfitInput)) {
    std::cerr << "note: no figure: " << cause << "\n";
    return;
  }
  std::cerr << "note: the figure was not drawn" << (cause.empty() ? "" : " (" + cause + ")")
            << "; it needs Debian's python3-matplotlib and the script " << script << ".\n";
}

void require_script(const std::string& script, const std::vector<std::string>& arguments,
                    const std::string& failure, const std::string& needs) {
  const auto [status, errors] = run_python(find_script(script), arguments);
  if (status == 0) return;
  const std::string cause = last_line(errors);
  if (exited_with(status, kUnfitInput)) throw UsageError(cause);
  throw RunError(failure + (cause.empty() ? "" : " (" + cause + ")") + "; it needs Debian's " + needs +
                 " and the script " + script);
}

void require_figure(const std::string& script, const std::vector<std::string>& arguments) {
  require_script(script, arguments, "the figure was not drawn", "python3-matplotlib");
}

}  // namespace hotpath
