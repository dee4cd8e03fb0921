// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "results/recovered_run.hpp"
#include "results/summary_table.hpp"

namespace hotpath {

namespace {

struct RecoverOptions {
  std::string run;
};

}  // namespace

void add_recover_command(CLI::App& app) {
  auto [command, o] = add_command<RecoverOptions>(
      app, "recover", "Make a result of what a killed run left: its finished repetitions",
      "hotpath recover runs/killed",
      [](const RecoverOptions& options) { write_table(std::cout, recover_run(options.run)); });
  command.add_option("RUN", o.run, "Folder of `hotpath run` or `compare`")->required();
}

}  // namespace hotpath
