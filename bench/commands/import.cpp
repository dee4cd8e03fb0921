// SPDX-License-Identifier: Apache-2.0
#include "import/import_caret.hpp"
#include "import/import_ctf.hpp"
#include "import/import_irobot.hpp"

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath {

namespace {

void add_import_ctf_command(CLI::App& import) {
  auto [ctf, o] = add_command<ImportCtfOptions>(
      import, "ctf", "A trace of ros2_tracing (CTF 1.8): graph, run, costs, self-check",
      "hotpath import ctf ~/traces/robot --output robot", import_ctf);
  add_text(ctf, "TRACE", o.trace, "FOLDER", "Folder of the trace, or one above it")->required();
  add_text(ctf, "--output", o.output, "FOLDER", "New folder for the results; by default imports/TRACE");
  add_text(ctf, "--executor", o.executor, "NAME",
           "Executor that was recorded (`hotpath list executors`), where\nthe trace does not tell");
  add_text(ctf, "--deployment", o.deployment, "FILE",
           "Deployment that was recorded: policies and processors are\nnot in a trace");
  ctf.add_option(
         "--chain", o.chains,
         "Chain whose latency counts, from sources to a sink; several\nwith blanks between; by default "
         "found in the graph")
      ->type_name("SOURCE,...:SINK")
      ->check(not_empty());
  add_number(ctf, "--cores", o.cores, {1, 1024}, "N",
             "Processors that the system had; by default those on which\nits callbacks were seen");
  add_number(ctf, "--jobs", o.jobs, {100, 1e7}, "N",
             "Rules, times, chains and self-check are of the first N jobs");
}

void add_import_caret_command(CLI::App& import) {
  auto [caret, o] = add_command<ImportCaretOptions>(
      import, "caret", "An architecture file of CARET, with what CARET measured",
      "hotpath import caret architecture.yaml --stats stats_node --cores 8", import_caret);
  add_text(caret, "ARCHITECTURE", o.file, "FILE", "The architecture, its named paths as chains")->required();
  add_text(caret, "--stats", o.stats, "FOLDER",
           "Statistics of nodes of a report of CARET: frequencies and\nexecution times");
  add_text(caret, "--output", o.output, "FOLDER",
           "New folder for graph and deployment; by default imports/\nand the folder's name");
  add_number(caret, "--cores", o.cores, {1, kMaxWorkers}, "N", "Processors that the system had");
}

void add_import_irobot_command(CLI::App& import) {
  auto [irobot, o] =
      add_command<ImportIrobotOptions>(import, "irobot", "A topology of irobot-ros/ros2-performance (JSON)",
                                       "hotpath import irobot mont_blanc.json", import_irobot);
  add_text(irobot, "TOPOLOGY", o.file, "FILE", "The topology")->required();
  add_text(irobot, "--output", o.output, "FOLDER", "New folder for the graph; by default imports/TOPOLOGY");
}

void add_export_ctf_command(CLI::App& parent) {
  struct Options {
    std::string run, output;
  };
  auto [ctf, o] =
      add_command<Options>(parent, "ctf", "As a trace with the events of ros2_tracing (CTF 1.8)",
                           "hotpath export ctf runs/first --output traces/first",
                           [](const Options& options) { export_ctf(options.run, options.output); });
  add_text(ctf, "RUN", o.run, "FOLDER", "Folder of a run, live or simulated")->required();
  add_text(ctf, "--output", o.output, "FOLDER", "New folder for the trace")->required();
}

}  // namespace

void add_import_command(CLI::App& app) {
  CLI::App& import = *app.add_subcommand("import", "Make a graph from what a real system was seen doing");
  import.require_subcommand(1);
  add_import_ctf_command(import);
  add_import_caret_command(import);
  add_import_irobot_command(import);
}

void add_export_command(CLI::App& app) {
  CLI::App& parent = *app.add_subcommand("export", "Write a run in the format of other tools");
  parent.require_subcommand(1);
  add_export_ctf_command(parent);
}

}  // namespace hotpath
