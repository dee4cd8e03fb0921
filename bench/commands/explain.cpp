// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"
#include "commands/command.hpp"

namespace hotpath::commands {

const Command kExplain("Understand", 130, [](CLI::App& app) {
  auto [command, o] = add_command<explain::Options>(
      app, "explain", "Account for the latency of a stored run's outputs, cause by cause",
      "hotpath explain runs/first --executors rm-ro --worst", explain::explain);
  add(command, "RUN", o.run, "FOLDER", "Folder of a live, simulated or imported run")->required();
  add(command, "OTHER", o.other, "FOLDER", "A second run, to explain why one is faster");
  add_list(
      command, "--executors", o.executors, "NAMES",
      "Executor of the run; by default its first. Two, separated by a comma, to explain why one is faster");
  add(command, "--repetition", o.repetition, {0, 1e9}, "N", "Repetition of the run; by default all");
  add(command, "--chain", o.chain, "NAME", "Chain; by default the graph's first");
  add(command, "--task", o.task, "NAME", "Explain response times of this task instead")->excludes("--chain");
  add(command, "--hot-path", o.hot_path,
      "Explain the hot-path latency, from the latest source's start to\n"
      "the sink's (the paper's metric), not the age of the data")
      ->excludes("--task");
  add(command, "--worst", o.worst, "Explain only the output with the largest latency");
  add(command, "--quantile", o.quantile, {0, 1}, "Q", "Explain only the output at this quantile")
      ->excludes("--worst");
  add(command, "--sequence", o.sequence, kAnySeed, "N",
      "Explain only this output: the sequence of the sink's job, or with --task of the task's")
      ->excludes("--worst")
      ->excludes("--quantile");
  add(command, "--json", o.json, "Print JSON");
  show_first(command, {"--executors", "--chain", "--task", "--worst", "--quantile"});
});

}  // namespace hotpath::commands
