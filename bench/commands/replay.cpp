// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "telemetry/replay.hpp"

namespace hotpath {

void add_replay_command(CLI::App& app) {
  auto options = std::make_shared<ReplayOptions>();
  ReplayOptions& o = *options;
  CLI::App* replay = app.add_subcommand("replay", "Publish a live or simulated run again, in real time");
  replay->add_option("RUN", o.run, "Folder of the run")->required();
  replay->add_flag("--live", o.live,
                   "Over Fast DDS, as `run --live` does, and the run's time on\n"
                   "topic hotpath/clock, 100 times a second");
  replay->add_option("--executor", o.executor, "As named there; by default the first")->type_name("NAME");
  add_number(*replay, "--repetition", o.repetition, 0, 1e9, "N", "Which repetition")->capture_default_str();
  replay->add_option("--graph", o.graph, "Where the run's graph is now, if it has moved")->type_name("GRAPH");
  add_number(*replay, "--speed", o.speed, 0.001, 1000, "X", "Seconds of the run in a second")
      ->capture_default_str();
  add_number(*replay, "--start", o.start_s, 0, 1e9, "SECONDS", "Begin, after the epoch of the run")
      ->capture_default_str();
  add_number(*replay, "--duration", o.duration_s, 0.001, 1e9, "SECONDS",
             "Time of the run to replay; by default to its end");
  add_number(*replay, "--domain", o.domain, 0, 232, "N", "DDS domain")->capture_default_str();
  replay->add_flag("--all-interfaces", o.all_interfaces, "Every network interface, not loopback alone");
  replay->footer("Example:  hotpath replay runs/first --live --speed 0.5");
  replay->callback([options] { replay_run(*options); });
}

}  // namespace hotpath
