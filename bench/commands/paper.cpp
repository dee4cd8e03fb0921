// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "machine/release_cost.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "validation/validation.hpp"

namespace hotpath::commands {

namespace {

/// The table for one release cost.
struct WcrtTable {
  const char* title;
  const char* name;  ///< In the column `delta_of` of wcrt_table.csv.
  std::int64_t delta;
};

struct TaskRow {
  const char* task;
  std::optional<std::int64_t> WcrtColumn::*bound;
};
constexpr std::array kTasks = {TaskRow{"IMU", &WcrtColumn::imu}, TaskRow{"Camera", &WcrtColumn::camera},
                               TaskRow{"LiDAR", &WcrtColumn::lidar}};

void print(const WcrtTable& table) {
  const auto columns = wcrt_table(table.delta);
  std::vector<std::string> header = {"task"};
  for (const WcrtColumn& c : columns) header.push_back(std::to_string(c.utilisation_percent) + " %");
  program::Table rows(
      program::text("%s (delta = %.3f us, Delta = n * delta = %.4f ms)", table.title,
                    static_cast<double>(table.delta) / 1e3, static_cast<double>(7 * table.delta) / 1e6),
      header);
  for (std::size_t i = 0; i < kTasks.size(); ++i) {
    std::vector<program::Value> cells = {kTasks[i].task};
    for (const WcrtColumn& c : columns) {
      const auto bound = c.*kTasks[i].bound;
      cells.push_back((bound ? program::fixed(static_cast<double>(*bound) / 1e6, 2) : "-") +
                      program::text(" (%6.2f)", c.printed_ms[i]));
    }
    rows.add_row(cells);
  }
  std::cout << rows << "\n";
}

/// The stored rows.
program::Table rows_of(std::span<const WcrtTable> tables) {
  program::Table rows("", {"delta_of", "delta_ns", "utilisation_percent", "task", "bound_ns", "printed_ms"});
  for (const WcrtTable& table : tables) {
    for (const WcrtColumn& column : wcrt_table(table.delta)) {
      for (std::size_t i = 0; i < kTasks.size(); ++i) {
        rows.add_row({table.name, table.delta, column.utilisation_percent, kTasks[i].task,
                      column.*kTasks[i].bound, column.printed_ms[i]});
      }
    }
  }
  return rows;
}

void print_table1(const std::string& output) {
  if (!output.empty()) program::check_output_folder(output, "wcrt_table.csv");
  const machine::ReleaseCost measured = machine::measure_release_cost();
  const std::array tables = {
      WcrtTable{"With the paper's release cost", "paper", kPaperDelta},
      WcrtTable{"With this machine's release cost, 99.9th percentile", "this machine (p99.9)",
                measured.p999.count()},
      WcrtTable{"With this machine's release cost, maximum", "this machine (maximum)", measured.max.count()}};
  std::cout << "Analytical worst-case response times in ms of the RM events executor (printed values of "
               "Table I in parentheses)\n\n";
  for (const WcrtTable& table : tables) print(table);
  std::cout << "The printed table corresponds to delta = 0.119 ms (Delta = 0.833 ms), which the paper's text "
               "rounds to 0.12 ms.\n`-`: no bound within the deadline.\n";
  const program::Table rows = rows_of(tables);
  program::show_json(json_of(rows));
  if (output.empty()) return;
  const std::filesystem::path folder = output;
  program::create_folder(folder);
  program::write_whole_file(folder / "wcrt_table.csv", csv_of(rows));
  using Pass = machine::ReleaseCost::Pass;
  const std::vector<program::Column<Pass>> costs = {{"timers", &Pass::timers},
                                                    {"passes", &Pass::passes},
                                                    {"p50_ns", &Pass::p50},
                                                    {"p99_ns", &Pass::p99},
                                                    {"max_ns", &Pass::max}};
  program::write_whole_file(folder / "release_cost.csv", csv_of(program::table_of(costs, measured.passes)));
}

struct WatersArguments {
  WatersOptions options;
  std::string output = "runs/waters";
};

std::string with_interval(const ClusteredEstimate& e) {
  return program::text("%.2f [%.2f, %.2f]", e.value, e.low, e.high);
}

std::vector<program::Column<WatersSummary>> summary_columns() {
  using S = WatersSummary;
  std::vector<program::Column<S>> columns = {{"utilisation", &S::utilisation},
                                             {"method", &S::method},
                                             {"sets", &S::sets},
                                             {"schedulable", &S::schedulable}};
  const auto add = [&](const std::string& name, ClusteredEstimate S::*of) {
    columns.emplace_back(name, [of](const S& s) { return (s.*of).value; });
    columns.emplace_back(name + "_low", [of](const S& s) { return (s.*of).low; });
    columns.emplace_back(name + "_high", [of](const S& s) { return (s.*of).high; });
  };
  add("schedulable_share", &S::schedulable_share);
  columns.emplace_back("sets_with_chains", &S::sets_with_chains);
  columns.emplace_back("chains", &S::chains);
  add("mean", &S::mean);
  add("median", &S::median);
  add("p25", &S::p25);
  add("p75", &S::p75);
  add("positive_share", &S::positive_share);
  const std::vector<program::Column<S>> others = {{"deviation", &S::deviation},
                                                  {"min", &S::min},
                                                  {"p1", &S::p1},
                                                  {"p5", &S::p5},
                                                  {"p95", &S::p95},
                                                  {"p99", &S::p99},
                                                  {"max", &S::max}};
  columns.insert(columns.end(), others.begin(), others.end());
  return columns;
}

void run_waters_experiment(WatersArguments& arguments) {
  program::check_output_folder(arguments.output, "waters.csv");
  arguments.options.methods = {WatersMethod::brueggen_davare, WatersMethod::davis_davare,
                               WatersMethod::davis_duerr, WatersMethod::davis_kloda,
                               WatersMethod::davis_guenzel};
  const WatersResult result = run_waters(arguments.options);
  const std::filesystem::path folder = arguments.output;
  program::create_folder(folder);
  const std::vector<WatersSummary> summaries = summarise_waters(arguments.options, result);
  const auto write = [&](const char* file, const program::FileContent& content) {
    program::write_whole_file(folder / file, content);
  };
  write("waters.csv", [&](std::ostream& out) { write_waters_csv(out, arguments.options, result); });
  const program::Table summary = program::table_of(summary_columns(), summaries);
  write("waters_summary.csv", csv_of(summary));
  write("waters_histogram.csv", [&](std::ostream& out) {
    write_waters_histogram_csv(out, waters_histograms(arguments.options, result));
  });
  program::Table table(
      "Normalised reduction of the end-to-end bound relative to the default executor, percent [95 % "
      "interval]",
      {"util", "method", "schedulable", "chains", "median", "mean", "min", "max", "share > 0"});
  for (const WatersSummary& s : summaries) {
    table.add_row({program::fixed(s.utilisation, 2), to_string(s.method),
                   program::text("%u/%u", s.schedulable, s.sets), std::to_string(s.chains),
                   with_interval(s.median), with_interval(s.mean), program::fixed(s.min, 2),
                   program::fixed(s.max, 2), program::fixed(s.positive_share.value, 4)});
  }
  std::cout << table;
  program::show_json(json_of(summary));
  std::cout << "\nResults: " << folder.string() << "\n";
}

struct GoldenArguments {
  std::string reference, output;
};

struct FigureArguments {
  std::string live, output = "runs/paper";
  bool quick = false;
  std::vector<std::string> only;
};

void add_figures(CLI::App& paper) {
  auto [figures, o] = add_command<FigureArguments>(
      paper, "figures", "All tables and figures of the evaluation, on one page",
      "hotpath paper figures --only wcrt-table,hot-path", [](const FigureArguments& a) {
        if (a.quick && a.live == "full") throw program::UsageError("give either --quick or --live full");
        const std::string mode = a.quick ? "quick" : a.live == "full" ? "full" : "standard";
        const nlohmann::json options = {
            {"mode", mode}, {"live", !a.live.empty()}, {"only", a.only}, {"output", a.output}};
        program::become_python_tool("reproduce", {options.dump()});
      });
  figures
      .add_option("--live", o.live,
                  in_lines("Also measure: takes hours, resumable (with --quick: minutes); full: as long as "
                           "the paper's runs, 300 s and 600 s"))
      ->expected(0, 1)
      ->default_str("standard")
      ->check(CLI::IsMember({"standard", "full"}).description(""))
      ->type_name("[standard|full]");
  add(figures, "--quick", o.quick, "All items with short runs");
  add_list(figures, "--only", o.only, "ITEMS",
           "Only these items (`hotpath list figures`), separated by commas");
  add(figures, "--output", o.output, "FOLDER", "Folder for results and for resuming");
}

}  // namespace

const Command kPaper("Paper", 180, [](CLI::App& app) {
  CLI::App& paper =
      *app.add_subcommand("paper", "Reproduce the paper's tables and figures; check the simulator");
  paper.footer("Example:  hotpath paper table1");
  paper.require_subcommand(1);
  add_figures(paper);
  auto [table, output] = add_command<std::string>(
      paper, "table1", "Table I: analytical worst-case response times", "hotpath paper table1", print_table1);
  add(table, "--output", output, "FOLDER", "Folder for the table and this machine's release cost (CSV)");
  add_json_option(table);
  auto [waters, o] = add_command<WatersArguments>(paper, "waters",
                                                  "Section VII-B: end-to-end bounds on WATERS 2015 task sets",
                                                  "hotpath paper waters --sets 10", run_waters_experiment);
  add(waters, "--sets", o.options.sets, {1, 1e6}, "N", "Task sets per utilisation");
  add(waters, "--seed", o.options.seed, kAnySeed, "N", "Seed of the task sets");
  add_threads_option(waters, o.options.threads);
  add(waters, "--output", o.output, "FOLDER", "Folder for the tables");
  add_json_option(waters);
  auto [golden, measured] = add_command<GoldenArguments>(
      paper, "golden", "The simulator against schedules and latencies of the real ROS 2 stack",
      "hotpath paper golden",
      [](const GoldenArguments& a) { validation::validate_simulator(a.reference, a.output); });
  add(golden, "FOLDER", measured.reference, "",
      "Reference measurements; by default as installed with hotpath");
  add(golden, "--output", measured.output, "FOLDER",
      "New folder for the results; by default runs/DATE-golden");
  add_json_option(golden);
  add_paper_threads(paper);
});

}  // namespace hotpath::commands
