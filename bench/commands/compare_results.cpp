// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include "commands/commands.hpp"
#include "program/python_tool.hpp"

namespace hotpath {

namespace {

struct Arguments {
  std::string before, after, csv;
};

void compare_results(const Arguments& arguments) {
  std::vector<std::string> words = {arguments.before, arguments.after};
  if (!arguments.csv.empty()) words.insert(words.end(), {"--csv", arguments.csv});
  run_python_tool("compare-results", words);
}

}  // namespace

void add_compare_results_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("compare-results", "Which percentiles of NEW differ from those of OLD beyond noise");
  command->add_option("OLD", arguments->before, "Folder of a reproduction, or of a run")->required();
  command->add_option("NEW", arguments->after, "Folder of the same kind")->required();
  command->add_option("--csv", arguments->csv, "Also write the table to this file")->type_name("FILE");
  command->footer("Example:  hotpath compare-results results/paper runs/paper");
  command->callback([arguments] { compare_results(*arguments); });
}

}  // namespace hotpath
