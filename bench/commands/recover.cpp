// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/json_output.hpp"
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
                                    const results::Summary summary = results::recover_run(options.run);
                                    results::write_table(std::cout, summary);
                                    program::show_json(summary);
                                  });
  command.add_option("RUN", o.run, "Folder of a killed `hotpath run` or `hotpath compare`")
      ->type_name("FOLDER")
      ->required();
  add_json_option(command);
}

}  // namespace hotpath::commands
