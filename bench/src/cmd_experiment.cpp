// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "commands.hpp"
#include "figures.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "hotpath/bench/errors.hpp"
#include "hotpath/bench/release_cost.hpp"
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

void run_wcrt_table() {
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
}

struct WatersArguments {
  WatersOptions options;
  std::string output = "runs/waters";
  bool more_methods = true;
};

std::ofstream open_csv(const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  if (!out) throw UsageError("--output: " + path.string() + " cannot be written");
  return out;
}

void write_waters(const WatersArguments& arguments, const WatersResult& result) {
  const std::filesystem::path folder = arguments.output;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw UsageError("--output: " + folder.string() + " cannot be created (" + error.message() + ")");
  const std::vector<WatersSummary> summaries = summarise_waters(arguments.options, result);
  auto rows = open_csv(folder / "waters.csv");
  write_waters_csv(rows, arguments.options, result);
  auto summary = open_csv(folder / "waters_summary.csv");
  write_waters_summary_csv(summary, summaries);
  auto histogram = open_csv(folder / "waters_histogram.csv");
  write_waters_histogram_csv(histogram, waters_histograms(arguments.options, result));
  for (auto* out : {&rows, &summary, &histogram}) {
    if (!out->flush()) throw RunError("writing to " + folder.string() + " failed; is the disk full?");
  }

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
  experiment->add_subcommand("wcrt-table", "Table I: analytical worst-case response times")
      ->callback(run_wcrt_table);

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
