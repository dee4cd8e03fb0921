// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <vector>

#include "commands/commands.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "machine/release_cost.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#ifdef HOTPATH_WITH_MPI
#include "hotpath/analysis/waters_mpi.hpp"
#endif

namespace hotpath {

namespace {

void print_wcrt_table(const char* title, std::int64_t delta) {
  std::printf("%s (delta = %.3f us, Delta = n * delta = %.4f ms)\n", title, static_cast<double>(delta) / 1e3,
              static_cast<double>(7 * delta) / 1e6);
  const auto columns = wcrt_table(delta);
  std::printf("  %-8s", "");
  for (const WcrtColumn& c : columns) std::printf("  %15d %%", c.utilisation_percent);
  std::printf("\n");
  const auto row = [&](const char* name, std::size_t line, auto member) {
    std::printf("  %-8s", name);
    for (const WcrtColumn& c : columns) {
      const auto bound = c.*member;
      char value[32] = "-";
      if (bound) std::snprintf(value, sizeof(value), "%.2f", static_cast<double>(*bound) / 1e6);
      std::printf("  %8s (%6.2f)", value, c.printed_ms[line]);
    }
    std::printf("\n");
  };
  row("IMU", 0, &WcrtColumn::imu);
  row("Camera", 1, &WcrtColumn::camera);
  row("LiDAR", 2, &WcrtColumn::lidar);
}

std::ofstream open_csv(const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  if (!out) throw UsageError("--output: " + path.string() + " cannot be written");
  return out;
}

void create_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw UsageError("--output: " + folder.string() + " cannot be created (" + error.message() + ")");
}

void finish_files(std::initializer_list<std::ofstream*> files, const std::filesystem::path& folder) {
  for (std::ofstream* out : files) {
    if (!out->flush()) throw RunError("writing to " + folder.string() + " failed; is the disk full?");
  }
}

void append_wcrt_rows(std::ofstream& out, const char* source, std::int64_t delta) {
  for (const WcrtColumn& column : wcrt_table(delta)) {
    const std::array<std::pair<const char*, std::optional<std::int64_t>>, 3> rows = {
        {{"IMU", column.imu}, {"Camera", column.camera}, {"LiDAR", column.lidar}}};
    for (std::size_t i = 0; i < rows.size(); ++i) {
      out << source << ',' << delta << ',' << column.utilisation_percent << ',' << rows[i].first << ',';
      if (rows[i].second) out << *rows[i].second;
      out << ',' << column.printed_ms[i] << '\n';
    }
  }
}

void write_wcrt_table(const std::filesystem::path& folder, const ReleaseCost& measured) {
  create_folder(folder);
  auto table = open_csv(folder / "wcrt_table.csv");
  table << "delta_of,delta_ns,utilisation_percent,task,bound_ns,printed_ms\n";
  append_wcrt_rows(table, "paper", kPaperDelta);
  append_wcrt_rows(table, "this machine (p99.9)", measured.p999.count());
  append_wcrt_rows(table, "this machine (maximum)", measured.max.count());
  auto cost = open_csv(folder / "release_cost.csv");
  cost << "timers,passes,p50_ns,p99_ns,max_ns\n";
  for (const ReleaseCost::Pass& pass : measured.passes) {
    cost << pass.timers << ',' << pass.passes << ',' << pass.p50.count() << ',' << pass.p99.count() << ','
         << pass.max.count() << '\n';
  }
  finish_files({&table, &cost}, folder);
}

void run_wcrt_table(const std::string& output) {
  std::printf(
      "Analytical worst-case response times in ms of the RM events executor (printed values of Table I in "
      "parentheses)\n\n");
  print_wcrt_table("With the paper's release cost", kPaperDelta);
  const ReleaseCost measured = measure_release_cost();
  std::printf("\n");
  print_wcrt_table("With this machine's, 99.9th percentile", measured.p999.count());
  std::printf("\n");
  print_wcrt_table("With this machine's, maximum", measured.max.count());
  std::printf(
      "\nThe printed table corresponds to delta = 0.119 ms (Delta = 0.833 ms), which the paper's text rounds "
      "to "
      "0.12 ms.\n`-`: no bound within the deadline.\n");
  if (!output.empty()) write_wcrt_table(output, measured);
}

struct WatersArguments {
  WatersOptions options;
  std::string output = "runs/waters";
  bool more_methods = true;
};

void write_waters(const WatersArguments& arguments, const WatersResult& result) {
  const std::filesystem::path folder = arguments.output;
  create_folder(folder);
  const std::vector<WatersSummary> summaries = summarise_waters(arguments.options, result);
  auto rows = open_csv(folder / "waters.csv");
  write_waters_csv(rows, arguments.options, result);
  auto summary = open_csv(folder / "waters_summary.csv");
  write_waters_summary_csv(summary, summaries);
  auto histogram = open_csv(folder / "waters_histogram.csv");
  write_waters_histogram_csv(histogram, waters_histograms(arguments.options, result));
  finish_files({&rows, &summary, &histogram}, folder);

  std::printf(
      "Normalised reduction of the end-to-end bound against the default executor's, percent [95 %% "
      "interval]\n\n");
  std::printf("%-5s %-18s %12s %8s %24s %24s %7s %7s %10s\n", "util", "method", "schedulable", "chains",
              "median", "mean", "min", "max", "share > 0");
  for (const WatersSummary& s : summaries) {
    char median[64], mean[64];
    std::snprintf(median, sizeof(median), "%.2f [%.2f, %.2f]", s.median.value, s.median.low, s.median.high);
    std::snprintf(mean, sizeof(mean), "%.2f [%.2f, %.2f]", s.mean.value, s.mean.low, s.mean.high);
    std::printf("%-5.2f %-18s %6u/%-5u %8llu %24s %24s %7.2f %7.2f %10.4f\n", s.utilisation,
                to_string(s.method), s.schedulable, s.sets, static_cast<unsigned long long>(s.chains), median,
                mean, s.min, s.max, s.positive_share.value);
  }
  draw_figure("waters.py", folder);
  std::printf("\nResults: %s\n", folder.c_str());
}

void run_waters_experiment(WatersArguments& arguments) {
  for (const double u : arguments.options.utilisations) {
    if (!(u > 0 && u <= 1)) throw UsageError("--utilisations: each must lie above 0 and at most at 1");
  }
  if (arguments.more_methods) {
    arguments.options.methods = {WatersMethod::brueggen_davare, WatersMethod::davis_davare,
                                 WatersMethod::davis_duerr, WatersMethod::davis_kloda,
                                 WatersMethod::davis_guenzel};
  }
#ifdef HOTPATH_WITH_MPI
  // Only under mpirun: starting MPI costs more than the experiment.
  if (std::getenv("OMPI_COMM_WORLD_SIZE") != nullptr || std::getenv("PMI_SIZE") != nullptr) {
    const MpiSession session(nullptr, nullptr);
    if (const auto result = run_waters_mpi(session, arguments.options)) write_waters(arguments, *result);
    return;
  }
#endif
  write_waters(arguments, run_waters(arguments.options));
}

}  // namespace

void add_experiment_command(CLI::App& app) {
  CLI::App* experiment = app.add_subcommand("experiment", "The paper's analytical experiments");
  experiment->require_subcommand(1);
  auto table_output = std::make_shared<std::string>();
  CLI::App* table = experiment->add_subcommand("wcrt-table", "Table I: analytical worst-case response times");
  table->add_option("--output", *table_output, "Folder for the table and this machine's release cost as CSV")
      ->type_name("FOLDER");
  table->callback([table_output] { run_wcrt_table(*table_output); });

  auto arguments = std::make_shared<WatersArguments>();
  CLI::App* waters =
      experiment->add_subcommand("waters", "Section VII-B: end-to-end bounds on WATERS 2015 task sets");
  waters->add_option("--sets", arguments->options.sets, "Task sets for each utilisation")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  waters->add_option("--utilisations", arguments->options.utilisations, "Separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  waters->add_option("--seed", arguments->options.seed, "The same seed gives the same sets")
      ->capture_default_str();
  waters->add_option("--threads", arguments->options.threads, "0: all processors; never changes a result")
      ->capture_default_str();
  waters->add_flag("!--paper-only", arguments->more_methods, "Only the paper's method, not the tighter ones");
  waters->add_option("--output", arguments->output, "Folder for tables and figure")->capture_default_str();
  waters->callback([arguments] {
    try {
      run_waters_experiment(*arguments);
    } catch (const AnalysisError& error) {
      throw UsageError(error.what());
    }
  });
}

}  // namespace hotpath
