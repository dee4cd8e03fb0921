// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands/commands.hpp"
#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

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
  if (const auto found = find_ros2_reference()) return *found;
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
    const double real = r.at("measured_ms").at("p50"), simulated = r.at("simulated_ms").at("p50");
    std::printf("%-17s %7.2f %10.2f %+6.1f %% %7.2f %10.2f\n", r.at("executor").get<std::string>().c_str(),
                real, simulated, 100 * (simulated / real - 1), r.at("measured_ms").at("p90").get<double>(),
                r.at("simulated_ms").at("p90").get<double>());
  }
}

std::string run_name(const json& run) {
  return run.at("executor").get<std::string>() + " #" + std::to_string(run.at("repetition").get<int>());
}

/// A number of a comparison, `-` where there is none.
std::string number(const json& of, const char* key, const char* format = "%.2f") {
  if (!of.contains(key) || of.at(key).is_null()) return "-";
  char text[32];
  std::snprintf(text, sizeof(text), format, of.at(key).get<double>());
  return text;
}

void print_run_latencies(const json& rows) {
  std::printf(
      "\nGiven runs: hot-path latency; real only for Autoware at the same load\n\n"
      "                           median ms                      p90 ms             phases\n"
      "executor             real    live  simulated      real    live  simulated   differ by\n"
      "------------------------------------------------------------------------------------\n");
  for (const json& r : rows) {
    if (!r.contains("measured_ms")) continue;
    const json& live = r.at("measured_ms");
    const json& simulated = r.at("simulated_ms");
    const json real = r.value("real_ms", json::object());
    std::printf("%-17s %7s %7s %10s   %7s %7s %10s  %7s ms\n", run_name(r).c_str(),
                number(real, "p50").c_str(), number(live, "p50").c_str(), number(simulated, "p50").c_str(),
                number(real, "p90").c_str(), number(live, "p90").c_str(), number(simulated, "p90").c_str(),
                number(r, "phases_differ_ms", "%.1f").c_str());
  }
}

void print_live_golden(const json& rows) {
  std::printf(
      "\nGiven runs against the golden traces, and against their own simulation (sim)\n\n"
      "                                 similarity of live  first     ");
  for (const char* quantity : {"start late p50", "response p50", "response p99", "by authors p50"}) {
    std::printf("  %14s, ms ", quantity);
  }
  std::printf("\nset             executor         to real  to sim     difference");
  for (int i = 0; i < 4; ++i) std::printf("  real   live    sim");
  std::printf("\n%s\n", std::string(138, '-').c_str());
  for (const json& r : rows) {
    if (!r.contains("golden")) continue;
    const json& golden = r.at("golden").at("comparison");
    const json& own = r.at("comparison");
    std::printf("%-15s %-16s %7.4f %7.4f  %13s", r.at("golden").at("set").get<std::string>().c_str(),
                run_name(r).c_str(), golden.at("similarity").get<double>(),
                own.at("similarity").get<double>(), first_difference(golden).c_str());
    const auto three = [&](const char* quantity, const char* quantile) {
      std::printf(" %5s  %5s  %5s", number(golden.at(quantity).at("real"), quantile, "%.1f").c_str(),
                  number(golden.at(quantity).at("live"), quantile, "%.1f").c_str(),
                  number(own.at(quantity).at("simulated"), quantile, "%.1f").c_str());
    };
    three("start_lateness_ms", "p50");
    three("response_ms", "p50");
    three("response_ms", "p99");
    three("response_authors_ms", "p50");
    std::printf("\n");
  }
  std::printf(
      "\nLost jobs in %% of the timestamps\n\n"
      "set             executor         task                 real    live     sim\n"
      "---------------------------------------------------------------------------\n");
  for (const json& r : rows) {
    if (!r.contains("golden")) continue;
    const json& golden = r.at("golden").at("comparison").at("tasks");
    const json& own = r.at("comparison").at("tasks");
    for (std::size_t t = 0; t < golden.size(); ++t) {
      std::printf("%-15s %-16s %-18s %6s  %6s  %6s\n", r.at("golden").at("set").get<std::string>().c_str(),
                  run_name(r).c_str(), golden[t].at("task").get<std::string>().c_str(),
                  number(golden[t], "real_lost_percent", "%.1f").c_str(),
                  number(golden[t], "live_lost_percent", "%.1f").c_str(),
                  number(own[t], "simulated_lost_percent", "%.1f").c_str());
    }
  }
}

void print_runs(const json& rows) {
  std::printf(
      "\nGiven runs: order of jobs against the simulation with their phases and execution times\n\n"
      "executor           jobs  similarity  first difference  largest loss difference\n"
      "------------------------------------------------------------------------------\n");
  for (const json& r : rows) {
    const json& c = r.at("comparison");
    std::printf("%-16s %6d %11.4f %17s %22.1f %%\n", run_name(r).c_str(),
                c.at("jobs").at("measured").get<int>(), c.at("similarity").get<double>(),
                first_difference(c).c_str(), c.at("largest_loss_difference_percent").get<double>());
  }
}

void print_verdicts(const json& result) {
  std::printf("\nHow good it is, and why not better\n");
  for (const char* part : {"golden", "timers_only", "autoware", "runs"}) {
    for (const json& r : result.at(part)) {
      const std::string set = r.contains("set") ? r.at("set").get<std::string>() + ", " : std::string();
      const std::string name = r.contains("repetition") ? run_name(r) : r.at("executor").get<std::string>();
      std::printf("  %s%s: %s.\n", set.c_str(), name.c_str(), r.at("verdict").get<std::string>().c_str());
      if (!r.contains("golden")) continue;
      std::printf("  %s, %s, live against the real stack: %s.\n",
                  r.at("golden").at("set").get<std::string>().c_str(), run_name(r).c_str(),
                  r.at("golden").at("verdict").get<std::string>().c_str());
    }
  }
}

bool any_has(const json& rows, const char* key) {
  return std::any_of(rows.begin(), rows.end(), [&](const json& r) { return r.contains(key); });
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
    for (json& r : validate_run(run, reference)) result["runs"].push_back(std::move(r));
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
    if (any_has(result.at("runs"), "measured_ms")) print_run_latencies(result.at("runs"));
    if (any_has(result.at("runs"), "golden")) print_live_golden(result.at("runs"));
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
