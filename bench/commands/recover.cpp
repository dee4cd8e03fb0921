// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "results/recovered_run.hpp"
#include "results/summary_table.hpp"

namespace hotpath::commands {

namespace {

struct RecoverOptions {
  std::string run;
};

}  // namespace

void add_recover_command(CLI::App& app) {
  auto [command, o] =
      add_command<RecoverOptions>(app, "recover", "Recover the finished repetitions of a killed run",
                                  "hotpath recover runs/killed", [](const RecoverOptions& options) {
                                    results::write_table(std::cout, results::recover_run(options.run));
                                  });
  command.add_option("RUN", o.run, "Folder of a killed `hotpath run` or `hotpath compare`")
      ->type_name("FOLDER")
      ->required();
}

}  // namespace hotpath::commands
