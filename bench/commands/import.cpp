// SPDX-License-Identifier: Apache-2.0
#include "import/import_ctf.hpp"

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath::commands {

namespace {

void add_import_ctf_command(CLI::App& import) {
  auto [ctf, o] = add_command<imports::CtfOptions>(
      import, "ctf", "Import a ros2_tracing trace (CTF 1.8): graph, run, costs, self-check",
      "hotpath import ctf ~/traces/robot --output robot", imports::import_ctf);
  add_text(ctf, "TRACE", o.trace, "FOLDER", "Folder of the trace, or a parent folder")->required();
  add_text(ctf, "--output", o.output, "FOLDER", "New folder for the results; by default imports/TRACE");
  add_text(ctf, "--executors", o.executor, "NAME",
           "Recorded executor (`hotpath list executors`), if the trace\ndoes not identify it");
  add_text(ctf, "--deployments", o.deployment, "FILE",
           "Recorded deployment; a trace lacks thread policies and CPUs");
  add_text(ctf, "--chain", o.chains, "SOURCE,...:SINK",
           "Chain to measure, from sources to a sink; several separated\n"
           "by blanks; by default found in the graph");
  add_number(ctf, "--cores", o.cores, {1, 1024}, "N",
             "CPU cores of the recorded system; by default the CPUs that\nran its callbacks");
  add_number(ctf, "--jobs", o.jobs, {100, 1e7}, "N", "First jobs of the trace, of which all results are");
}

}  // namespace

void add_import_command(CLI::App& app) {
  CLI::App& import = *app.add_subcommand("import", "Create a graph from a recording of a real system");
  import.footer("Example:  hotpath import ctf ~/traces/robot --output robot");
  import.require_subcommand(1);
  add_import_ctf_command(import);
}

const Command kImport("Your robot", 100, add_import_command);

}  // namespace hotpath::commands
