// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replay.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath::commands {

void add_replay_command(CLI::App& app) {
  auto [replay, o] = add_command<telemetry::ReplayOptions>(
      app, "replay", "Publish a stored run over Fast DDS in real time, with its clock",
      "hotpath replay runs/first --rate 50", telemetry::replay_run);
  replay.add_option("RUN", o.run, kRunHelp)->type_name("FOLDER")->required();
  add_text(replay, "--executors", o.executor, "NAME", kRunExecutorHelp);
  add_number(replay, "--repetition", o.repetition, {0, 1e9}, "N", kRunRepetitionHelp);
  add_text(replay, "--graph", o.graph, "GRAPH", "New location of the run's graph, if it has moved");
  add_number(replay, "--rate", o.rate_percent, {0.1, 1e5}, "PERCENT",
             "Playback rate in percent of real time");
  add_number(replay, "--from", o.start_s, {0, 1e9}, "SECONDS", "Start, after the epoch of the run");
  add_number(replay, "--duration", o.duration_s, {0.001, 1e9}, "SECONDS",
             "Time of the run to replay; by default to its end");
  add_number(replay, "--domain", o.domain, {0, 232}, "N", kDomainHelp);
  replay.add_flag("--all-interfaces", o.all_interfaces, kAllInterfacesHelp);
}

const Command kReplay("Understand", 160, add_replay_command);

}  // namespace hotpath::commands
