// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"

namespace hotpath {

void add_experiment_command(CLI::App& app) {
  CLI::App* experiment = app.add_subcommand("experiment", "The paper's analytical experiments");
  experiment->require_subcommand(1);
  add_wcrt_table_experiment(*experiment);
  add_waters_experiment(*experiment);
}

}  // namespace hotpath
