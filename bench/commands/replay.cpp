// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replay.hpp"
#include "commands/command.hpp"

namespace hotpath::commands {

const Command kReplay("Understand", 160, [](CLI::App& app) {
  auto [replay, o] = add_command<telemetry::ReplayOptions>(
      app, "replay", "Publish a stored run over Fast DDS in real time, with its clock",
      "hotpath replay runs/first --rate 50", telemetry::replay_run);
  replay.add_option("RUN", o.run, kRunHelp)->type_name("FOLDER")->required();
  add(replay, "--executors", o.executor, "NAME", kRunExecutorHelp);
  add(replay, "--repetition", o.repetition, {0, 1e9}, "N", kRunRepetitionHelp);
  add(replay, "--graph", o.graph, "GRAPH", "New location of the run's graph, if it has moved");
  add(replay, "--rate", o.rate_percent, {0.1, 1e5}, "PERCENT", "Playback rate in percent of real time");
  add(replay, "--from", o.start_s, {0, 1e9}, "SECONDS", "Start, after the epoch of the run");
  add(replay, "--duration", o.duration_s, {0.001, 1e9}, "SECONDS",
      "Time of the run to replay; by default to its end");
  add(replay, "--domain", o.domain, {0, 232}, "N", kDomainHelp);
  add(replay, "--all-interfaces", o.all_interfaces, kAllInterfacesHelp);
});

}  // namespace hotpath::commands
