// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/reference_system/ros2_reference.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"
#include "validation/validation.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

std::string first_difference(const ScheduleComparison& c) {
  return c.first_difference ? text("at %.5g s", to_ms(c.first_difference->at - Time{}) / 1e3) : "-";
}

std::string range(const Range& r) { return text("%.1f-%.1f", r.front(), r.back()); }

TextTable golden_table(const std::vector<GoldenValidation>& rows) {
  TextTable table(
      "Golden traces: every job of the real stack against the simulator",
      {"set", "executor", "similarity\nno costs", "similarity\ncosts", "first\ndifference",
       "lost IMU %\nreal", "lost IMU %\nsimulated", "response p50\nreal ms", "response p50\nsimulated ms"});
  for (const GoldenValidation& v : rows) {
    const ScheduleComparison& c = v.with_costs;
    table.add_row({v.set, v.executor, fixed(v.without_costs.similarity, 4), fixed(c.similarity, 4),
                   first_difference(c), fixed(c.tasks.back().lost_percent[0], 1),
                   fixed(c.tasks.back().lost_percent[1], 1), fixed(c.response_ms[0].p50, 1),
                   fixed(c.response_ms[1].p50, 1)});
  }
  return table;
}

TextTable timers_only_table(const std::vector<TimersOnlyValidation>& rows) {
  TextTable table(
      "Timers only, longer runs of unrecorded phases: ranges over repetitions and over creation steps;\n"
      "response times as the authors define them, p50 in ms, mean of tasks",
      {"set", "executor", "lost IMU %\nreal", "lost IMU %\nsimulated", "response\nreal",
       "response\nsimulated"});
  for (const TimersOnlyValidation& v : rows) {
    table.add_row({v.set, v.executor, range(v.measured.imu_lost_percent), range(v.simulated.imu_lost_percent),
                   range(v.measured.response_authors_p50_ms), range(v.simulated.response_authors_p50_ms)});
  }
  return table;
}

TextTable autoware_table(const std::vector<AutowareValidation>& rows) {
  TextTable table(
      "Autoware with the real stack's phases: hot-path latency in ms",
      {"executor", "median\nreal", "median\nsimulated", "median\ndiffers", "p90\nreal", "p90\nsimulated"});
  for (const AutowareValidation& v : rows) {
    table.add_row({v.executor, fixed(v.measured.p50, 2), fixed(v.simulated.p50, 2),
                   text("%+.1f %%", 100 * (v.simulated.p50 / v.measured.p50 - 1)), fixed(v.measured.p90, 2),
                   fixed(v.simulated.p90, 2)});
  }
  return table;
}

TextTable runs_table(const std::vector<RunValidation>& rows) {
  TextTable table("Given runs: order of jobs against the simulation with their phases and execution times",
                  {"executor", "jobs", "similarity", "first\ndifference", "largest loss\ndifference"});
  for (const RunValidation& v : rows) {
    table.add_row({v.name(), std::to_string(v.comparison.jobs[0]), fixed(v.comparison.similarity, 4),
                   first_difference(v.comparison), fixed(v.comparison.largest_loss_difference(), 1) + " %"});
  }
  return table;
}

TextTable run_latencies_table(const std::vector<RunValidation>& rows) {
  TextTable table("Given runs: hot-path latency in ms; real only for Autoware at the same load",
                  {"executor", "median\nreal", "median\nrun", "median\nsimulated", "p90\nreal", "p90\nrun",
                   "p90\nsimulated", "phases\ndiffer by ms"});
  for (const RunValidation& v : rows) {
    if (!v.latencies) continue;
    const RunLatencies& l = *v.latencies;
    const LatencyQuantiles real = l.real.value_or(LatencyQuantiles{});
    table.add_row({v.name(), fixed(real.p50, 2), fixed(l.run.p50, 2), fixed(l.simulated.p50, 2),
                   fixed(real.p90, 2), fixed(l.run.p90, 2), fixed(l.simulated.p90, 2),
                   fixed(l.phases_differ_ms.value_or(kNoValue), 1)});
  }
  return table;
}

TextTable run_golden_table(const std::vector<RunValidation>& rows) {
  TextTable table(
      "Given runs against the golden traces, and against their own simulation (sim);\n"
      "start: how late p50, response: p50, p99, and p50 as the authors define it, in ms",
      {"set", "executor", "similarity\nreal, sim", "first\ndifference", "start\nreal, run, sim",
       "response p50\nreal, run, sim", "response p99\nreal, run, sim", "by authors\nreal, run, sim"});
  for (const RunValidation& v : rows) {
    if (!v.golden) continue;
    const ScheduleComparison& golden = v.golden->comparison;
    const auto three = [&](Quantiles(ScheduleComparison::*of)[2], double Quantiles::*quantile) {
      return fixed((golden.*of)[0].*quantile, 1) + " " + fixed((golden.*of)[1].*quantile, 1) + " " +
             fixed((v.comparison.*of)[1].*quantile, 1);
    };
    table.add_row({v.golden->set, v.name(),
                   fixed(golden.similarity, 4) + " " + fixed(v.comparison.similarity, 4),
                   first_difference(golden), three(&ScheduleComparison::lateness_ms, &Quantiles::p50),
                   three(&ScheduleComparison::response_ms, &Quantiles::p50),
                   three(&ScheduleComparison::response_ms, &Quantiles::p99),
                   three(&ScheduleComparison::response_authors_ms, &Quantiles::p50)});
  }
  return table;
}

TextTable lost_jobs_table(const std::vector<RunValidation>& rows) {
  TextTable table("Lost jobs in % of the timestamps", {"set", "executor", "task", "real", "run", "sim"});
  for (const RunValidation& v : rows) {
    if (!v.golden) continue;
    const auto& golden = v.golden->comparison.tasks;
    for (std::size_t t = 0; t < golden.size(); ++t) {
      table.add_row({v.golden->set, v.name(), golden[t].task, fixed(golden[t].lost_percent[0], 1),
                     fixed(golden[t].lost_percent[1], 1), fixed(v.comparison.tasks[t].lost_percent[1], 1)});
    }
  }
  return table;
}

void write_verdicts(std::ostream& out, const Validation& validation) {
  out << "How good it is, and why not better\n";
  const auto write = [&](const std::string& what, const std::string& verdict) {
    out << "  " << what << ": " << verdict << ".\n";
  };
  for (const auto& v : validation.golden) write(v.set + ", " + v.executor, v.verdict);
  for (const auto& v : validation.timers_only) write(v.set + ", " + v.executor, v.verdict);
  for (const auto& v : validation.autoware) write(v.executor, v.verdict);
  for (const RunValidation& v : validation.runs) {
    write(v.name(), v.verdict);
    if (v.golden) write(v.golden->set + ", " + v.name() + ", run against the real stack", v.golden->verdict);
  }
}

void write_validation(std::ostream& out, const Validation& validation) {
  for (const TextTable& table : {golden_table(validation.golden), timers_only_table(validation.timers_only),
                                 autoware_table(validation.autoware), runs_table(validation.runs),
                                 run_latencies_table(validation.runs), run_golden_table(validation.runs),
                                 lost_jobs_table(validation.runs)}) {
    if (!table.empty()) out << table << "\n";
  }
  write_verdicts(out, validation);
}

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
  write_whole_file(folder / "validation.json", "--output", nlohmann::json(validation));
  write_validation(std::cout, validation);
  draw_figure("validate", folder);
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
}

}  // namespace

void add_validate_command(CLI::App& app) {
  auto [command, o] = add_command<ValidateOptions>(
      app, "validate", "Compare simulation, live runs and the real ROS 2 stack side by side",
      "hotpath validate runs/first", validate);
  command.add_option("RUN", o.runs,
                     "Folders of runs, to compare with their own simulation and,\nwhere it measured the "
                     "same graph, with the real stack");
  add_text(command, "--reference", o.reference, "FOLDER",
           "Folder of the reference measurements; by default those\nthat come with this program");
  add_text(command, "--output", o.output, "FOLDER",
           "New folder for the results; by default runs/DATE-validate");
}

}  // namespace hotpath
