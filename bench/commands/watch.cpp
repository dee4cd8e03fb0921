// SPDX-License-Identifier: Apache-2.0
#include "watch/watch.hpp"
#include "commands/command.hpp"

namespace hotpath::commands {

const Command kWatch("Your robot", 120, [](CLI::App& app) {
  auto [command, o] = add_command<watch::WatchOptions>(
      app, "watch", "Watch the callbacks of a running ROS 2 program",
      "hotpath watch -- ros2 launch my_robot robot.launch.py", [](const watch::WatchOptions& options) {
        program::catch_interrupts();
        watch::watch(options);
      });
  command
      .add_option("COMMAND", o.command,
                  "Program to start and watch, with its arguments, after `--`;\n"
                  "its standard output goes to standard error. Without one, attach\n"
                  "to programs that run with --print-environment")
      ->type_name("");
  add(command, "--print-environment", o.print_environment,
      "Only print the variables with which programs run so that\n"
      "`hotpath watch` without COMMAND can attach to them:\n"
      "env $(hotpath watch --print-environment) PROGRAM");
  add(command, "--for", o.seconds, {0.1, 1e7}, "SECONDS",
      "Stop the program after this time; by default watch until it exits");
  add(command, "--once", o.once, "Report once, at the end, instead of every second");
  auto* const contract = add(command, "--contract", o.contract, "FILE",
                             "Compare the jobs with this contract (docs/contract.md)");
  add(command, "--fail-on", o.fail_on, "Exit with code 3 if a term of the contract is broken")
      ->needs(contract);
  auto* const record = add(command, "--output", o.record, "FOLDER",
                           "Keep the last events, and write them as CTF into a subfolder at\neach of "
                           "the first 20 incidents and on "
                           "SIGUSR1");
  add(command, "--keep", o.keep, {1, 600}, "SECONDS", "Events that --output keeps; by default 10")
      ->needs(record);
  add(command, "--json", o.json, "Print a line of JSON for each report and, without --once, each incident");
  show_first(command, {"--print-environment", "--for", "--once", "--contract", "--output"});
  command.get_option("--print-environment")
      ->excludes("COMMAND", "--for", "--once", "--contract", "--fail-on", "--output", "--keep", "--json");
});

}  // namespace hotpath::commands
