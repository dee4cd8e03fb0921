// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/shown_text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_summary.hpp"
#include "results/summary_table.hpp"

namespace hotpath::commands {

namespace {

struct SummarizeOptions {
  std::string run, responses, golden;
};

void summarize_run(const SummarizeOptions& options) {
  if (!options.golden.empty()) {
    program::data_output() << results::summarize_golden_trace(options.golden).dump(2) << "\n";
    return;
  }
  if (options.run.empty()) throw program::UsageError("summarize: give the folder of a run");
  const results::StoredRun run(options.run, "summarize");
  if (options.responses == "-") {
    if (program::prints_json())
      throw program::UsageError(
          "summarize: --responses - prints CSV in place of the summary; leave out --json");
    results::ResponsesCsv responses(program::data_output(), run);
    results::for_each_record(run, [&](const JobRow& row) { responses.add(row); });
    return responses.finish();
  }
  results::Summary summary;
  if (options.responses.empty()) {
    summary = results::summarize(run, run.summary_options());
  } else {
    program::write_output_file(options.responses, "--responses", [&](std::ostream& out) {
      results::ResponsesCsv responses(out, run);
      summary =
          results::summarize(run, run.summary_options(), [&](const JobRow& row) { responses.add(row); });
      responses.finish();
    });
  }
  const nlohmann::json content = summary;
  program::write_whole_file(run.folder() / "summary.json", content);
  results::write_table(std::cout, summary);
  program::show_json(content);
}

}  // namespace

void add_summarize_command(CLI::App& app) {
  auto [command, o] = add_command<SummarizeOptions>(
      app, "summarize", "Recompute the summary of a stored run with this version's measures",
      "hotpath summarize runs/first", summarize_run);
  CLI::Option* const run = command.add_option("RUN", o.run, kRunHelp)->type_name("FOLDER");
  add_output_file(command, "--responses", o.responses,
                  "Also write the response time of every counted job as CSV;\n"
                  "`-` prints the CSV instead of the summary");
  add_text(command, "--golden", o.golden, "FILE",
           "Instead of RUN: summarise the timers of a golden trace, as\nJSON to standard output")
      ->excludes(run)
      ->excludes("--responses")
      ->excludes(add_json_option(command));
}

}  // namespace hotpath::commands
