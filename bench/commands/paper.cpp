// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "commands/command.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "machine/release_cost.hpp"
#include "validation/validation.hpp"

namespace hotpath::commands {

namespace {

struct TaskRow {
  const char* task;
  std::optional<std::int64_t> WcrtColumn::*bound;
};
constexpr std::array kTasks = {TaskRow{"IMU", &WcrtColumn::imu}, TaskRow{"Camera", &WcrtColumn::camera},
                               TaskRow{"LiDAR", &WcrtColumn::lidar}};

/// The table for the release cost `delta`. Adds its values to the stored rows, named `delta_of`.
Table wcrt_of(const char* title, const char* delta_of, std::int64_t delta, Table& stored) {
  const auto ns = static_cast<double>(delta);
  Table shown(text("%s (delta = %.3f us, Delta = n * delta = %.4f ms)", title, ns / 1e3, 7 * ns / 1e6),
              {"task"});
  for (const TaskRow& row : kTasks) shown.add_row({row.task});
  for (const WcrtColumn& column : wcrt_table(delta)) {
    shown.header.push_back(concat(column.utilisation_percent, " %"));
    for (std::size_t i = 0; i < kTasks.size(); ++i) {
      const auto bound = column.*kTasks[i].bound;
      shown.rows[i].emplace_back((bound ? fixed(static_cast<double>(*bound) / 1e6, 2) : "-") +
                                 text(" (%6.2f)", column.printed_ms[i]));
      stored.add_row(
          {delta_of, delta, column.utilisation_percent, kTasks[i].task, bound, column.printed_ms[i]});
    }
  }
  return shown;
}

void print_table1(const std::string& output) {
  if (!output.empty()) program::check_output_folder(output, "wcrt_table.csv");
  const machine::ReleaseCost measured = machine::measure_release_cost();
  Table rows("", {"delta_of", "delta_ns", "utilisation_percent", "task", "bound_ns", "printed_ms"});
  std::cout
      << "Analytical worst-case response times in ms of the RM events executor (printed values of "
         "Table I in parentheses)\n\n"
      << wcrt_of("With the paper's release cost", "paper", kPaperDelta, rows) << "\n"
      << wcrt_of("With this machine's release cost, 99.9th percentile", "this machine (p99.9)",
                 measured.p999.count(), rows)
      << "\n"
      << wcrt_of("With this machine's release cost, maximum", "this machine (maximum)", measured.max.count(),
                 rows)
      << "\nThe printed table corresponds to delta = 0.119 ms (Delta = 0.833 ms), which the paper's text "
         "rounds to 0.12 ms.\n`-`: no bound within the deadline.\n";
  program::show_json(json_of(rows));
  if (output.empty()) return;
  const std::filesystem::path folder = output;
  program::create_folder(folder);
  program::write_whole_file(folder / "wcrt_table.csv", csv_of(rows));
  Table costs("", {"timers", "passes", "p50_ns", "p99_ns", "max_ns"});
  for (const auto& pass : measured.passes)
    costs.add_row({pass.timers, pass.passes, pass.p50, pass.p99, pass.max});
  program::write_whole_file(folder / "release_cost.csv", csv_of(costs));
}

struct WatersArguments {
  WatersOptions options;
  std::string output = "runs/waters";
};

std::string with_interval(const ClusteredEstimate& e) {
  return text("%.2f [%.2f, %.2f]", e.value, e.low, e.high);
}

/// The stored rows, with the intervals of estimates.
Table stored_rows(const std::vector<WatersSummary>& summaries) {
  using S = WatersSummary;
  std::vector<program::Column<S>> columns = {{"utilisation", &S::utilisation},
                                             {"method", &S::method},
                                             {"sets", &S::sets},
                                             {"schedulable", &S::schedulable},
                                             {"sets_with_chains", &S::sets_with_chains},
                                             {"chains", &S::chains},
                                             {"deviation", &S::deviation},
                                             {"min", &S::min},
                                             {"p1", &S::p1},
                                             {"p5", &S::p5},
                                             {"p95", &S::p95},
                                             {"p99", &S::p99},
                                             {"max", &S::max}};
  const auto insert = [&](std::ptrdiff_t at, const std::string& name, ClusteredEstimate S::*of) {
    columns.insert(columns.begin() + at, {{name, [of](const S& s) { return (s.*of).value; }},
                                          {name + "_low", [of](const S& s) { return (s.*of).low; }},
                                          {name + "_high", [of](const S& s) { return (s.*of).high; }}});
  };
  insert(6, "positive_share", &S::positive_share);
  insert(6, "p75", &S::p75);
  insert(6, "p25", &S::p25);
  insert(6, "median", &S::median);
  insert(6, "mean", &S::mean);
  insert(4, "schedulable_share", &S::schedulable_share);
  return program::table_of(columns, summaries);
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
  const Table summary = stored_rows(summaries);
  program::write_whole_file(folder / "waters.csv",
                            [&](std::ostream& out) { write_waters_csv(out, arguments.options, result); });
  program::write_whole_file(folder / "waters_summary.csv", csv_of(summary));
  program::write_whole_file(folder / "waters_histogram.csv", [&](std::ostream& out) {
    write_waters_histogram_csv(out, waters_histograms(arguments.options, result));
  });
  Table table(
      "Normalised reduction of the end-to-end bound relative to the default executor, percent [95 % "
      "interval]",
      {"util", "method", "schedulable", "chains", "median", "mean", "min", "max", "share > 0"});
  for (const WatersSummary& s : summaries) {
    table.add_row({fixed(s.utilisation, 2), s.method, text("%u/%u", s.schedulable, s.sets), s.chains,
                   with_interval(s.median), with_interval(s.mean), fixed(s.min, 2), fixed(s.max, 2),
                   fixed(s.positive_share.value, 4)});
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
        if (a.quick && a.live == "full") throw UsageError("give either --quick or --live full");
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
  CLI::App& paper = add_parent(app, "paper", "Reproduce the paper's tables and figures; check the simulator",
                               "hotpath paper table1");
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
