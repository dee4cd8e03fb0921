// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "results/stored_run.hpp"
#include "results/stored_summary.hpp"
#include "results/summary.hpp"

namespace hotpath::commands {

namespace {

struct ReportArguments {
  std::vector<std::string> runs;
  std::string output;
  bool summary = false;
};

void summarize(const std::string& folder) {
  const results::StoredRun run(folder, "report --summary");
  const results::Summary summary = results::summarize(run, run.summary_options());
  const nlohmann::json content = summary;
  program::write_whole_file(run.folder() / "summary.json", content);
  results::write_table(std::cout, summary);
  program::show_json(content);
}

void report(const ReportArguments& a) {
  if (a.summary) {
    if (a.runs.size() != 1) throw UsageError("report --summary: give one RUN");
    return summarize(a.runs.front());
  }
  std::vector<std::string> words = a.runs;
  if (!a.output.empty()) {
    program::check_output_folder(a.output, "report.html");
    words.insert(words.end(), {"--output", a.output});
  }
  program::become_python_tool("report", words);
}

}  // namespace

const Command kReport("Understand", 140, [](CLI::App& app) {
  auto [command, o] = add_command<ReportArguments>(
      app, "report", "Write a page about one or more runs, or recompute a summary",
      "hotpath report runs/live runs/simulated --output page", report);
  add(command, "RUN", o.runs, "FOLDER", "Folders of live or simulated runs, or of a reproduction")
      ->required();
  CLI::Option* const output = add(command, "--output", o.output, "FOLDER",
                                  "Folder for the page; by default report/ in the first RUN");
  CLI::Option* const summary = add(command, "--summary", o.summary,
                                   "Instead of a page: recompute the run's summary with this version's "
                                   "measures, store it as its summary.json and print it")
                                   ->excludes(output);
  add_json_option(command)->needs(summary);
});

}  // namespace hotpath::commands
