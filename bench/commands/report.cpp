// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/memory_limit.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"

namespace hotpath {

namespace {

/// What a command of the Python package is given.
struct ReportArguments {
  std::vector<std::string> runs;
  std::string before, after, output;
  bool gate = false, across_loads = false;
  std::string junit, markdown;
};

void run_tool(const std::string& command, std::vector<std::string> words, const std::string& option,
              const std::string& output) {
  if (!output.empty()) words.insert(words.end(), {option, output});
  become_python_tool(command, words);
}

/// A page has all latencies and response times in Python's memory.
void report(const ReportArguments& a) {
  if (!a.output.empty()) check_output_folder(a.output, "report.html");
  constexpr double kMemoryOfByte = 3;
  double bytes = 0;
  for (const std::string& run : a.runs) {
    for (const char* const file : {"jobs.csv", "chains.csv"}) {
      std::error_code none;
      const auto size = std::filesystem::file_size(std::filesystem::path(run) / file, none);
      if (!none) bytes += kMemoryOfByte * static_cast<double>(size);
    }
  }
  check_memory(bytes, "report", "all response times", "fewer or shorter runs, or summary.json of each");
  run_tool("report", a.runs, "--output", a.output);
}

}  // namespace

void add_report_command(CLI::App& app) {
  auto [command, o] = add_command<ReportArguments>(
      app, "report", "One page, HTML and Markdown, about any runs or comparisons",
      "hotpath report runs/live runs/simulated --output page", report);
  command.add_option("RUN", o.runs, "Folders of `hotpath run`, `compare` or `simulate`")->required();
  add_text(command, "--output", o.output, "FOLDER",
           "Folder of the page; by default report/ in the first RUN");
}

void add_compare_results_command(CLI::App& app) {
  auto [command, o] = add_command<ReportArguments>(
      app, "compare-results", "Which percentiles of NEW differ from those of OLD beyond noise",
      "hotpath compare-results results/paper runs/paper", [](const ReportArguments& a) {
        std::vector<std::string> words = {a.before, a.after};
        if (a.gate) words.emplace_back("--gate");
        if (a.across_loads) words.emplace_back("--across-loads");
        if (!a.junit.empty()) words.push_back("--junit=" + a.junit);
        if (!a.markdown.empty()) words.push_back("--markdown=" + a.markdown);
        run_tool("compare-results", words, "--csv", a.output);
      });
  command.add_option("OLD", o.before, "Folder of a reproduction, or of a run")->required();
  command.add_option("NEW", o.after, "Folder of the same kind")->required();
  command.add_flag(
      "--across-loads", o.across_loads,
      "Compare runs of different loads, rates or copies; else only\nwhat ran at the same load is compared");
  CLI::Option* const csv = add_output_file(command, "--csv", o.output, "Also write the table to this file");
  CLI::Option* const gate = command
                                .add_flag("--gate", o.gate,
                                          "Decide whether anything became worse, beyond noise and\ncorrected "
                                          "for many comparisons: exit code 1 if so")
                                ->excludes(csv);
  add_output_file(command, "--junit", o.junit, "With --gate: also write test cases for CI")->needs(gate);
  add_output_file(command, "--markdown", o.markdown, "With --gate: also write a summary for a pull request")
      ->needs(gate);
}

}  // namespace hotpath
