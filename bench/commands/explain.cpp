// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath::commands {

void add_explain_command(CLI::App& app) {
  auto [command, o] = add_command<explain::Options>(
      app, "explain", "Account for the latency of a stored run's outputs, cause by cause",
      "hotpath explain runs/first --executors rm-ro --worst", explain::explain);
  add_text(command, "RUN", o.run, "FOLDER", "Folder of a live, simulated or imported run")->required();
  add_text(command, "OTHER", o.other, "FOLDER", "A second run, to explain why one is faster");
  add_list(command, "--executors", o.executors, "NAMES",
           "Executor of the run; by default its first. Two, separated by\n"
           "a comma, to explain why one is faster");
  add_number(command, "--repetition", o.repetition, {0, 1e9}, "N", "Repetition of the run; by default all");
  add_text(command, "--chain", o.chain, "NAME", "Chain; by default the graph's first");
  add_text(command, "--task", o.task, "NAME", "Explain response times of this task instead")
      ->excludes("--chain");
  command
      .add_flag("--hot-path", o.hot_path,
                "Explain the hot-path latency, from the latest source's start to\n"
                "the sink's (the paper's metric), not the age of the data")
      ->excludes("--task");
  command.add_flag("--worst", o.worst, "Explain only the output with the largest latency");
  add_number(command, "--quantile", o.quantile, {0, 1}, "Q", "Explain only the output at this quantile")
      ->excludes("--worst");
  add_number(command, "--sequence", o.sequence, kAnySeed, "N",
             "Explain only this output: the sequence of the sink's job, or\nwith --task of the task's")
      ->excludes("--worst")
      ->excludes("--quantile");
  command.add_flag("--json", o.json, "Print JSON");
  show_first(command, {"--executors", "--chain", "--task", "--worst", "--quantile"});
}

const Command kExplain("Understand", 130, add_explain_command);

}  // namespace hotpath::commands
