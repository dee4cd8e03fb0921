// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "results/checked_run.hpp"

namespace hotpath::commands {

namespace {

struct CheckOptions {
  std::string run;
};

void check(const CheckOptions& options) {
  const results::CheckedRun checked = results::check_run(options.run);
  std::cout << options.run << ": " << checked.rows << " rows of jobs.csv, " << checked.repetitions
            << (checked.repetitions == 1 ? " repetition" : " repetitions")
            << ": a valid schedule: one job per thread at a time, no early job, no job after the end, "
               "nothing lost or duplicated\n";
}

}  // namespace

void add_check_command(CLI::App& app) {
  auto [command, o] =
      add_command<CheckOptions>(app, "check", "Check that the jobs of a stored run form a valid schedule",
                                "hotpath check runs/first", check);
  command.add_option("RUN", o.run, program::concat(kRunHelp, " with jobs.csv"))
      ->type_name("FOLDER")
      ->required();
}

}  // namespace hotpath::commands
