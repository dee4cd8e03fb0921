// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "import/import_ctf.hpp"

namespace hotpath::commands {

const Command kImport("Your robot", 100, [](CLI::App& app) {
  CLI::App& import = add_parent(app, "import", "Create a graph from a recording of a real system",
                                "hotpath import ctf ~/traces/robot --output robot");
  auto [ctf, o] = add_command<imports::CtfOptions>(
      import, "ctf", "Import a ros2_tracing trace (CTF 1.8): graph, run, costs, self-check",
      "hotpath import ctf ~/traces/robot --output robot", imports::import_ctf);
  add(ctf, "TRACE", o.trace, "FOLDER", "Folder of the trace, or a parent folder")->required();
  add(ctf, "--output", o.output, "FOLDER", "New folder for the results; by default imports/TRACE");
  add_list(ctf, "--executors", o.executors, "NAMES",
           "Recorded executors (`hotpath list executors`) where the trace does not tell them, as multi from "
           "multi-jazzy, or cbg from cbg-3178");
  add(ctf, "--deployments", o.deployment, "FILE",
      "Recorded deployment; a trace lacks thread policies and CPUs");
  add(ctf, "--chain", o.chains, "SOURCE,...:SINK",
      "Chain to measure, from sources to a sink; several separated by blanks; by default found in the graph");
  add(ctf, "--cores", o.cores, {1, 1024}, "N",
      "CPU cores of the recorded system; by default the CPUs that ran its callbacks");
  add(ctf, "--jobs", o.jobs, {100, 1e7}, "N", "First jobs of the trace, of which all results are");
});

}  // namespace hotpath::commands
