// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "comparison/comparison.hpp"
#include "validation/validation.hpp"

namespace hotpath::commands {

namespace {

struct DiffArguments {
  std::vector<std::string> runs;
  bool simulated = false;
  comparison::Options options;
};

void diff(DiffArguments& a) {
  if (a.simulated) return validation::validate_runs(a.runs, a.options.output);
  if (a.runs.size() != 2) throw UsageError("diff: give OLD and NEW, or one RUN with --simulated");
  if (!a.options.output.empty()) program::check_output_folder(a.options.output, "report.html", "--output");
  a.options.old = a.runs[0];
  a.options.now = a.runs[1];
  if (comparison::compare(a.options)) throw CLI::RuntimeError();
}

}  // namespace

const Command kDiff("Understand", 150, [](CLI::App& app) {
  auto [command, o] = add_command<DiffArguments>(
      app, "diff", "Compare latencies of two results, or of a run and its simulation",
      "hotpath diff results/paper runs/paper", diff);
  add(command, "RUN", o.runs, "FOLDER",
      "OLD and NEW: folders of two runs, reproductions or benchmark results; with --simulated: folders of "
      "runs")
      ->required();
  CLI::Option* const across =
      add(command, "--across-loads", o.options.across_loads,
          "Also compare runs with different loads, rates or copies; by default only runs at the same load");
  CLI::Option* const csv = add_output_file(command, "--csv", o.options.csv, "Also write the table as CSV");
  CLI::Option* const gate =
      add(command, "--gate", o.options.gate,
          "Exit with code 1 if NEW has a significant regression, corrected for multiple comparisons")
          ->excludes(csv);
  add(command, "--output", o.options.output, "FOLDER",
      "Also write report.html, a page with both distributions, and report.md into this folder; with "
      "--simulated: new folder for the results, by default runs/DATE-diff");
  add_json_option(command);
  add_output_file(command, "--junit", o.options.junit, kJunitHelp)->needs(gate);
  add_output_file(command, "--markdown", o.options.markdown, kMarkdownHelp)->needs(gate);
  add(command, "--simulated", o.simulated,
      "Compare runs with simulations of their phases, measured execution times and costs and, for graphs of "
      "the reference measurements, with the real ROS 2 stack")
      ->excludes(across)
      ->excludes(csv)
      ->excludes(gate);
  show_first(command, {"--across-loads", "--gate", "--output", "--simulated", "--csv"});
});

}  // namespace hotpath::commands
