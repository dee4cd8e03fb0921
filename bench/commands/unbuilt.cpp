// SPDX-License-Identifier: Apache-2.0
// Stands for the commands that a first measurement does not need, where these are not built.
#include "commands/command.hpp"

namespace hotpath::commands {

namespace {

constexpr const char* kGroup =
    "Not built yet; run `launch_scripts/setup.sh && HOTPATH_TARGET=hotpath launch_scripts/build.sh`";

}  // namespace

const Command kUnbuilt(kGroup, 200, [](CLI::App& app) {
  for (const std::string name : {HOTPATH_UNBUILT}) {
    CLI::App& command = *app.add_subcommand(name)->group(kGroup)->allow_extras();
    command.callback([name] { throw UsageError("`" + name + "`: " + kGroup); });
  }
});

}  // namespace hotpath::commands
