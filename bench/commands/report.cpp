// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "page/page_data.hpp"
#include "program/memory_limit.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"

namespace hotpath::commands {

namespace {

/// The arguments of the commands that the Python package implements.
struct ReportArguments {
  std::vector<std::string> runs;
  std::string before, after, output;
  bool json = false, gate = false, across_loads = false;
  std::string junit, markdown, page;
};

void run_tool(const std::string& command, std::vector<std::string> words, const std::string& option,
              const std::string& output) {
  if (!output.empty()) words.insert(words.end(), {option, output});
  program::become_python_tool(command, words);
}

/// Python holds all latencies and response times of a page in memory.
void check_page_memory(const std::vector<std::string>& runs, const std::string& command) {
  constexpr double kMemoryOfByte = 3;
  double bytes = 0;
  for (const std::string& run : runs) {
    for (const char* const file : {"jobs.csv", "chains.csv"}) {
      std::error_code none;
      const auto size = std::filesystem::file_size(std::filesystem::path(run) / file, none);
      if (!none) bytes += kMemoryOfByte * static_cast<double>(size);
    }
  }
  program::check_memory(bytes, command, "all response times",
                        "fewer or shorter runs, or summary.json of each");
}

void report(const ReportArguments& a) {
  if (a.json) {
    using nlohmann::json;
    program::data_output() << page::page_data(a.runs).dump(-1, ' ', false, json::error_handler_t::replace)
                           << "\n";
    return;
  }
  if (!a.output.empty()) program::check_output_folder(a.output, "report.html");
  check_page_memory(a.runs, "report");
  run_tool("report", a.runs, "--output", a.output);
}

}  // namespace

void add_report_command(CLI::App& app) {
  auto [command, o] =
      add_command<ReportArguments>(app, "report", "Write an HTML and Markdown report about one or more runs",
                                   "hotpath report runs/live runs/simulated --output page", report);
  command.add_option("RUN", o.runs, "Folders of live or simulated runs")->type_name("FOLDER")->required();
  CLI::Option* const output = add_text(command, "--output", o.output, "FOLDER",
                                       "Folder for the report; by default report/ in the first RUN");
  command
      .add_flag("--json", o.json,
                "Instead of a report: print the jobs, explained outputs and\n"
                "graphs that it shows, as JSON")
      ->excludes(output);
}

void add_compare_results_command(CLI::App& app) {
  auto [command, o] = add_command<ReportArguments>(
      app, "compare-results", "Compare latency percentiles of two results, with confidence intervals",
      "hotpath compare-results results/paper runs/paper", [](const ReportArguments& a) {
        std::vector<std::string> words = {a.before, a.after};
        if (a.gate) words.emplace_back("--gate");
        if (a.across_loads) words.emplace_back("--across-loads");
        if (!a.page.empty()) {
          program::check_output_folder(a.page, "report.html", "--page");
          check_page_memory({a.before, a.after}, "compare-results --page");
          words.push_back("--page=" + a.page);
        }
        if (!a.junit.empty()) words.push_back("--junit=" + a.junit);
        if (!a.markdown.empty()) words.push_back("--markdown=" + a.markdown);
        run_tool("compare-results", words, "--csv", a.output);
      });
  command.add_option("OLD", o.before, "Baseline: folder of a run, a reproduction or `bench`")
      ->type_name("FOLDER")
      ->required();
  command.add_option("NEW", o.after, "Folder of the same kind, to compare with OLD")
      ->type_name("FOLDER")
      ->required();
  command.add_flag(
      "--across-loads", o.across_loads,
      "Also compare runs with different loads, rates or copies; by\ndefault only runs at the same load");
  CLI::Option* const csv = add_output_file(command, "--csv", o.output, "Also write the table as CSV");
  CLI::Option* const gate = command
                                .add_flag("--gate", o.gate,
                                          "Exit with code 1 if NEW has a significant regression,\n"
                                          "corrected for multiple comparisons")
                                ->excludes(csv);
  add_text(command, "--page", o.page, "FOLDER",
           "Also write report.html, a page with both distributions, and\nreport.md into this folder");
  add_json_option(command);
  add_output_file(command, "--junit", o.junit, kJunitHelp)->needs(gate);
  add_output_file(command, "--markdown", o.markdown, kMarkdownHelp)->needs(gate);
}

}  // namespace hotpath::commands
