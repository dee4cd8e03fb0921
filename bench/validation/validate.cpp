// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

namespace {

namespace fs = std::filesystem;

fs::path find_reference(const std::string& folder) {
  if (!folder.empty()) return folder;
  if (const auto installed = find_ros2_reference()) return *installed;
  throw program::UsageError("the reference measurements are not installed; give their folder");
}

fs::path checked_folder(const std::string& output) {
  const fs::path folder = setup::output_folder(output, "validate");
  program::check_output_folder(folder);
  return folder;
}

void store_and_show(const Validation& validation, const fs::path& folder) {
  program::create_folder(folder);
  nlohmann::json content = validation;
  content.update({{"kind", "validation"}, {"version", HOTPATH_VERSION}});
  program::write_whole_file(folder / "validation.json", "--output", content);
  program::show_json(content);
  program::become_python_tool("validate", {folder.string()});
}

}  // namespace

void validate_runs(const std::vector<std::string>& runs, const std::string& output) {
  const fs::path folder = checked_folder(output);
  const fs::path reference = find_reference("");
  Validation validation;
  for (const std::string& run : runs) {
    for (RunValidation& v : validate_run(run, reference)) validation.runs.push_back(std::move(v));
  }
  store_and_show(validation, folder);
}

void validate_simulator(const std::string& reference, const std::string& output) {
  const fs::path folder = checked_folder(output);
  const fs::path found = find_reference(reference);
  store_and_show({validate_golden_traces(found), validate_timers_only(found), validate_autoware(found), {}},
                 folder);
}

}  // namespace hotpath::validation
