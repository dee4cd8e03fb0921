// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "bounds/exact_worst_cases.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "hotpath/campaign/crew.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "machine/release_cost.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/deployed_system.hpp"
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
  Crew crew(arguments.options.threads);
  const WatersResult result = run_waters(arguments.options, crew);
  if (!crew.coordinates()) return;
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

constexpr std::size_t kChainCount = 3;
const std::string kThreeChains = "three_chains", kTwoThreads = "multi:2";

/// Values in ms that are published as upper bounds on the latencies of the chains.
struct Published {
  const char* source;
  bool any_phases;  ///< False: all timers begin at one instant.
  std::array<double, kChainCount> ms;
};
constexpr std::array kPublished = {
    Published{"Radulescu 2025, schedule-abstraction graph", false, {45.449, 56.099, 62.299}},
    Published{"Jiang 2022, as the artifact of Radulescu 2025 computes it", true, {54.1, 76.1, 104.0}},
    Published{"Jiang 2022, with the last chain's part", true, {103.3, 103.3, 103.3}}};

/// Phases under which some chain lasts long, found by a search over random phases; first those of the graph.
const std::vector<std::vector<std::string>> kLongPhases = {
    {},
    {"N/a1.phase_ms=73.8", "N/b1.phase_ms=71", "N/c1.phase_ms=71"},
    {"N/a1.phase_ms=29.4", "N/b1.phase_ms=11.7", "N/c1.phase_ms=129.2"},
    {"N/a1.phase_ms=11.1", "N/b1.phase_ms=2.1", "N/c1.phase_ms=152.3"}};

struct ReachedAge {
  std::int64_t ns = 0;
  std::size_t phases = 0;  ///< Index into kLongPhases.
};

std::string in_ms(std::int64_t ns) { return program::fixed(static_cast<double>(ns) / 1e6, 3); }

/// The exact worst cases by chain: with the phases of the graph, and with those of kLongPhases under which it
/// lasts longest.
std::array<std::array<ReachedAge, kChainCount>, 2> reached_ages(const setup::ExecutorSpec& executor) {
  std::array<std::array<ReachedAge, kChainCount>, 2> reached{};
  for (std::size_t p = 0; p < kLongPhases.size(); ++p) {
    Graph graph = load_graph(find_graph(kThreeChains), kLongPhases[p]);
    graph.platform.cores = worker_count(*executor.entry, executor.scheduler);
    const GraphBounds exact =
        bounds::exact_worst_cases(graph, make_tasks(graph), *executor.entry, executor.scheduler);
    if (exact.refusal) throw AnalysisError(*exact.refusal);
    for (std::size_t c = 0; c < kChainCount; ++c) {
      const std::int64_t age = exact.chains[c]->latency;
      if (p == 0) reached[0][c] = {age, 0};
      if (age > reached[1][c].ns) reached[1][c] = {age, p};
    }
  }
  return reached;
}

/// Prints published bounds for executors with several threads beside exact values and bounds of hotpath.
void judge_published_threads() {
  const setup::ExecutorSpec executor = setup::parse_executor(kTwoThreads, {});
  Graph graph = load_graph(find_graph(kThreeChains));
  graph.platform.cores = worker_count(*executor.entry, executor.scheduler);
  const auto bounds = setup::guarantees(graph, make_tasks(graph), executor);
  const auto reached = reached_ages(executor);
  program::Table table(
      "Published bounds on chains under " + kTwoThreads + ", execution times in [C/2, C], in ms",
      {"source", "phases", "chain", "published", "reached", "at most", "verdict", "schedule"});
  for (const Published& p : kPublished) {
    for (std::size_t c = 0; c < kChainCount; ++c) {
      const ReachedAge& longest = reached[p.any_phases ? 1 : 0][c];
      const std::int64_t most = p.any_phases ? bounds.value().chains[c].age.value().ns : longest.ns;
      const std::int64_t published = std::llround(p.ms[c] * 1e6);
      // A longer schedule refutes a value; an upper bound that it does not undercut confirms it.
      const char* const verdict = longest.ns > published ? "refuted"
                                  : published >= most    ? "confirmed"
                                                         : "open";
      table.add_row({p.source, p.any_phases ? "any" : "all 0", graph.chains[c].name, in_ms(published),
                     in_ms(longest.ns), in_ms(most), verdict, static_cast<std::int64_t>(longest.phases)});
    }
  }
  std::cout << table << "\nThe schedules, as runs that `hotpath report` and `hotpath explain` read:\n";
  for (std::size_t p = 0; p < kLongPhases.size(); ++p) {
    std::cout << p << ": hotpath analyze " << kThreeChains << " --executors " << kTwoThreads
              << " --cores 2 --phases given" << (kLongPhases[p].empty() ? "" : " --set ")
              << program::joined(kLongPhases[p], ",") << " --witness schedule" << p << "\n";
  }
  program::show_json(json_of(table));
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
  auto [threads, none] = add_command<NoOptions>(
      paper, "threads", "Published bounds for several threads against exact worst cases",
      "hotpath paper threads", [](const NoOptions&) { judge_published_threads(); });
  add_json_option(threads);
});

}  // namespace hotpath::commands
