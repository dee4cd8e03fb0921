// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

struct ValidateOptions {
  std::vector<std::string> runs;
  std::string reference, output;
  bool all = false;
};

fs::path find_reference(const std::string& given) {
  if (!given.empty()) return given;
  if (const auto found = find_ros2_reference()) return *found;
  throw UsageError("the reference measurements are not installed; name their folder with --reference");
}

void validate(const ValidateOptions& options) {
  const fs::path folder =
      options.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-validate" : options.output;
  check_output_folder(folder);
  const fs::path reference = find_reference(options.reference);
  Validation validation;
  if (options.all || options.runs.empty()) {
    validation = {
        validate_golden_traces(reference), validate_timers_only(reference), validate_autoware(reference), {}};
  }
  for (const std::string& run : options.runs) {
    for (RunValidation& v : validate_run(run, reference)) validation.runs.push_back(std::move(v));
  }
  create_folder(folder);
  nlohmann::json content = validation;
  content.update({{"kind", "validation"}, {"version", HOTPATH_VERSION}});
  write_whole_file(folder / "validation.json", "--output", content);
  become_python_tool("validate", {folder.string()});
}

}  // namespace

void add_validate_command(CLI::App& app) {
  auto [command, o] = add_command<ValidateOptions>(
      app, "validate", "Compare simulation, live runs and the real ROS 2 stack side by side",
      "hotpath validate runs/first", validate);
  command.add_option("RUN", o.runs,
                     "Folders of runs, to compare with their own simulation and,\nwhere it measured the "
                     "same graph, with the real stack; without\nany, the simulator against the real stack");
  command.add_flag("--all", o.all, "Also the simulator against the real stack, as without RUN");
  add_text(command, "--reference", o.reference, "FOLDER",
           "Folder of the reference measurements; by default those\nthat come with this program");
  add_text(command, "--output", o.output, "FOLDER",
           "New folder for the results; by default runs/DATE-validate");
}

}  // namespace hotpath
