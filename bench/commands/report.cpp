// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include "commands/commands.hpp"
#include "program/python_tool.hpp"

namespace hotpath {

namespace {

struct Arguments {
  std::vector<std::string> runs;
  std::string output;
};

void write_report(const Arguments& arguments) {
  std::vector<std::string> words = arguments.runs;
  if (!arguments.output.empty()) words.insert(words.end(), {"--output", arguments.output});
  run_python_tool("report", words);
}

}  // namespace

void add_report_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* report =
      app.add_subcommand("report", "One page, HTML and Markdown, about any runs or comparisons");
  report->add_option("RUN", arguments->runs, "Folders of `hotpath run`, `compare` or `simulate`")->required();
  report->add_option("--output", arguments->output, "Folder of the page; by default report/ in the first RUN")
      ->type_name("FOLDER");
  report->footer("Example:  hotpath report runs/live runs/simulated --output page");
  report->callback([arguments] { write_report(*arguments); });
}

}  // namespace hotpath
