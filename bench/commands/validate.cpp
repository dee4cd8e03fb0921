// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands/commands.hpp"
#include "commands/validation_tables.hpp"
#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

struct ValidateOptions {
  std::vector<std::string> runs;
  std::string reference, output;
};

fs::path find_reference(const std::string& given) {
  if (!given.empty()) return given;
  if (const auto found = find_ros2_reference()) return *found;
  throw UsageError("the reference measurements are not installed; name their folder with --reference");
}

void validate(const ValidateOptions& options) {
  const fs::path reference = find_reference(options.reference);
  Validation validation{
      validate_golden_traces(reference), validate_timers_only(reference), validate_autoware(reference), {}};
  for (const std::string& run : options.runs) {
    for (RunValidation& v : validate_run(run, reference)) validation.runs.push_back(std::move(v));
  }
  const fs::path folder =
      options.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-validate" : options.output;
  create_folder(folder);
  write_whole_file(folder / "validation.json", "--output", to_json(validation));
  write_validation(std::cout, validation);
  draw_figure("validate", folder);
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
}

}  // namespace

void add_validate_command(CLI::App& app) {
  auto options = std::make_shared<ValidateOptions>();
  CLI::App* command =
      app.add_subcommand("validate", "Compare simulation, live runs and the real ROS 2 stack side by side");
  command->add_option("RUN", options->runs,
                      "Folders of runs, to compare with their own simulation and,\nwhere it measured the "
                      "same graph, with the real stack");
  command
      ->add_option("--reference", options->reference,
                   "Folder of the reference measurements; by default those\nthat come with this program")
      ->type_name("FOLDER");
  command
      ->add_option("--output", options->output, "New folder for the results; by default runs/DATE-validate")
      ->type_name("FOLDER");
  command->footer("Example:  hotpath validate runs/first");
  command->callback([options] { validate(*options); });
}

}  // namespace hotpath
