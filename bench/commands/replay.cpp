// SPDX-License-Identifier: Apache-2.0

#include "telemetry/replay.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"

namespace hotpath {

void add_replay_command(CLI::App& app) {
  auto [replay, o] =
      add_command<ReplayOptions>(app, "replay", "Publish a live or simulated run again, in real time",
                                 "hotpath replay runs/first --live --speed 0.5", replay_run);
  replay.add_option("RUN", o.run, "Folder of the run")->required();
  replay.add_flag("--live", o.live,
                  "Over Fast DDS, as `run --live` does, and the run's time on\n"
                  "topic hotpath/clock, 100 times a second");
  add_text(replay, "--executor", o.executor, "NAME", "As named there; by default the first");
  add_number(replay, "--repetition", o.repetition, {0, 1e9}, "N", "Which repetition");
  add_text(replay, "--graph", o.graph, "GRAPH", "Where the run's graph is now, if it has moved");
  add_number(replay, "--speed", o.speed, {0.001, 1000}, "X", "Seconds of the run in a second");
  add_number(replay, "--start", o.start_s, {0, 1e9}, "SECONDS", "Begin, after the epoch of the run");
  add_number(replay, "--duration", o.duration_s, {0.001, 1e9}, "SECONDS",
             "Time of the run to replay; by default to its end");
  add_number(replay, "--domain", o.domain, {0, 232}, "N", "DDS domain");
  replay.add_flag("--all-interfaces", o.all_interfaces, "Every network interface, not loopback alone");
}

}  // namespace hotpath
