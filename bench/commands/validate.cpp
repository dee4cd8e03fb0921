// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

namespace hotpath::commands {

namespace {

namespace fs = std::filesystem;

struct ValidateOptions {
  std::vector<std::string> runs;
  std::string reference, output;
  bool all = false;
};

fs::path find_reference(const std::string& folder) {
  if (!folder.empty()) return folder;
  if (const auto installed = find_ros2_reference()) return *installed;
  throw program::UsageError(
      "the reference measurements are not installed; give their folder with --reference");
}

void validate(const ValidateOptions& options) {
  const fs::path folder = setup::output_folder(options.output, "validate");
  program::check_output_folder(folder);
  const fs::path reference = find_reference(options.reference);
  validation::Validation validation;
  if (options.all || options.runs.empty()) {
    validation = {validation::validate_golden_traces(reference),
                  validation::validate_timers_only(reference),
                  validation::validate_autoware(reference),
                  {}};
  }
  for (const std::string& run : options.runs) {
    for (validation::RunValidation& v : validation::validate_run(run, reference))
      validation.runs.push_back(std::move(v));
  }
  program::create_folder(folder);
  nlohmann::json content = validation;
  content.update({{"kind", "validation"}, {"version", HOTPATH_VERSION}});
  program::write_whole_file(folder / "validation.json", "--output", content);
  program::show_json(content);
  program::become_python_tool("validate", {folder.string()});
}

}  // namespace

void add_validate_command(CLI::App& app) {
  auto [command, o] = add_command<ValidateOptions>(
      app, "validate", "Compare simulations and live runs with the real ROS 2 stack",
      "hotpath validate runs/first", validate);
  command
      .add_option("RUN", o.runs,
                  "Runs to compare with their own simulation and, for graphs of\n"
                  "the reference measurements, with the ROS 2 stack; without\n"
                  "RUN, compare the simulator with the ROS 2 stack")
      ->type_name("FOLDER");
  command.add_flag("--all", o.all, "Also compare the simulator with the ROS 2 stack");
  add_text(command, "--reference", o.reference, "FOLDER",
           "Folder of the reference measurements; by default as installed\nwith hotpath");
  add_text(command, "--output", o.output, "FOLDER",
           "New folder for the results; by default runs/DATE-validate");
  add_json_option(command);
}

}  // namespace hotpath::commands
