// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands.hpp"
#include "experiment_facts.hpp"
#include "figures.hpp"
#include "hotpath/bench/errors.hpp"
#include "validation.hpp"
#include "whole_file.hpp"

namespace hotpath {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct ValidateOptions {
  std::vector<std::string> runs;
  std::string reference, output;
};

fs::path find_reference(const std::string& given) {
  if (!given.empty()) return given;
  std::istringstream folders(HOTPATH_REFERENCE_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (fs::exists(fs::path(folder) / "traces")) return folder;
  }
  throw UsageError("the reference measurements are not installed; name their folder with --reference");
}

std::string first_difference(const json& comparison) {
  const json& d = comparison.at("first_difference");
  if (d.is_null()) return "-";
  std::ostringstream text;
  text.precision(5);
  text << "at " << d.at("at_ms").get<double>() / 1e3 << " s";
  return text.str();
}

void print_golden(const json& golden) {
  std::printf(
      "Golden traces: every job of the real stack against the simulator\n\n"
      "                            similarity        first     lost, IMU in %%   response p50 ms\n"
      "set             executor  no costs  costs  difference   real  simulated   real  simulated\n"
      "------------------------------------------------------------------------------------------\n");
  for (const json& g : golden) {
    const json& c = g.at("with_costs");
    const json& imu = c.at("tasks").back();
    std::printf("%-15s %-9s %8.4f %6.4f  %10s %6.1f %10.1f %6.1f %10.1f\n",
                g.at("set").get<std::string>().c_str(), g.at("executor").get<std::string>().c_str(),
                g.at("without_costs").at("similarity").get<double>(), c.at("similarity").get<double>(),
                first_difference(c).c_str(), imu.at("measured_lost_percent").get<double>(),
                imu.at("simulated_lost_percent").get<double>(),
                c.at("response_ms").at("measured").at("p50").get<double>(),
                c.at("response_ms").at("simulated").at("p50").get<double>());
  }
}

void print_timers_only(const json& rows) {
  std::printf(
      "\nTimers only, longer runs of unrecorded phases: ranges over repetitions and over creation steps\n\n"
      "                                     lost, IMU in %%          authors' response p50 ms, mean of "
      "tasks\n"
      "set                     executor         real      simulated         real      simulated\n"
      "----------------------------------------------------------------------------------------\n");
  for (const json& r : rows) {
    const auto range = [&](const char* side, const char* key) {
      char text[32];
      const json& values = r.at(side).at(key);
      std::snprintf(text, sizeof(text), "%.1f-%.1f", values.at(0).get<double>(), values.at(1).get<double>());
      return std::string(text);
    };
    std::printf("%-23s %-9s %11s %14s %12s %14s\n", r.at("set").get<std::string>().c_str(),
                r.at("executor").get<std::string>().c_str(), range("measured", "imu_lost_percent").c_str(),
                range("simulated", "imu_lost_percent").c_str(),
                range("measured", "response_authors_p50_ms").c_str(),
                range("simulated", "response_authors_p50_ms").c_str());
  }
}

void print_latencies(const char* title, const json& rows) {
  std::printf(
      "\n%s\n\n"
      "                           median ms                    p90 ms\n"
      "executor             real  simulated  differ      real  simulated\n"
      "-----------------------------------------------------------------\n",
      title);
  for (const json& r : rows) {
    if (!r.contains("measured_ms")) continue;
    const double real = r.at("measured_ms").at("p50"), simulated = r.at("simulated_ms").at("p50");
    std::string name = r.at("executor");
    if (r.contains("repetition")) name += " #" + std::to_string(r.at("repetition").get<int>());
    std::printf("%-17s %7.2f %10.2f %+6.1f %% %7.2f %10.2f\n", name.c_str(), real, simulated,
                100 * (simulated / real - 1), r.at("measured_ms").at("p90").get<double>(),
                r.at("simulated_ms").at("p90").get<double>());
  }
}

void print_runs(const json& rows) {
  std::printf(
      "\nGiven runs: order of jobs against the simulation with their phases and execution times\n\n"
      "executor           jobs  similarity  first difference  largest loss difference\n"
      "------------------------------------------------------------------------------\n");
  for (const json& r : rows) {
    const json& c = r.at("comparison");
    const std::string name =
        r.at("executor").get<std::string>() + " #" + std::to_string(r.at("repetition").get<int>());
    std::printf("%-16s %6d %11.4f %17s %22.1f %%\n", name.c_str(), c.at("jobs").at("measured").get<int>(),
                c.at("similarity").get<double>(), first_difference(c).c_str(),
                c.at("largest_loss_difference_percent").get<double>());
  }
}

void print_verdicts(const json& result) {
  std::printf("\nHow good it is, and why not better\n");
  for (const char* part : {"golden", "timers_only", "autoware", "runs"}) {
    for (const json& r : result.at(part)) {
      const std::string set = r.contains("set") ? r.at("set").get<std::string>() + ", " : std::string();
      std::printf("  %s%s: %s.\n", set.c_str(), r.at("executor").get<std::string>().c_str(),
                  r.at("verdict").get<std::string>().c_str());
    }
  }
}

void validate(const ValidateOptions& options) {
  const fs::path reference = find_reference(options.reference);
  json result = {{"kind", "validation"},
                 {"version", HOTPATH_VERSION},
                 {"golden", validate_golden_traces(reference)},
                 {"timers_only", validate_timers_only(reference)},
                 {"autoware", validate_autoware(reference)},
                 {"runs", json::array()}};
  for (const std::string& run : options.runs) {
    for (json& r : validate_run(run)) result["runs"].push_back(std::move(r));
  }
  const fs::path folder =
      options.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-validate" : options.output;
  std::error_code error;
  fs::create_directories(folder, error);
  write_whole_file(folder / "validation.json", "--output",
                   [&](std::ostream& out) { out << result.dump(2) << "\n"; });
  print_golden(result.at("golden"));
  print_timers_only(result.at("timers_only"));
  print_latencies("Autoware with the real stack's phases: hot-path latency", result.at("autoware"));
  if (!result.at("runs").empty()) {
    print_runs(result.at("runs"));
    print_latencies("Given runs: hot-path latency", result.at("runs"));
  }
  print_verdicts(result);
  std::fflush(stdout);
  draw_figure("validate.py", folder);
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
}

}  // namespace

void add_validate_command(CLI::App& app) {
  auto options = std::make_shared<ValidateOptions>();
  CLI::App* command =
      app.add_subcommand("validate", "Compare simulation with the real ROS 2 stack, and live runs");
  command->add_option("RUN", options->runs, "Folders of runs to compare with their own simulation, besides");
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
