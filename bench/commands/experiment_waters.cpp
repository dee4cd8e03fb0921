// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "commands/commands.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/waters_statistics.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#ifdef HOTPATH_WITH_MPI
#include "hotpath/analysis/waters_mpi.hpp"
#endif

namespace hotpath {

namespace {

struct WatersArguments {
  WatersOptions options;
  std::string output = "runs/waters";
  bool more_methods = true;
};

std::string with_interval(const ClusteredEstimate& e) {
  return text("%.2f [%.2f, %.2f]", e.value, e.low, e.high);
}

void write_waters(const WatersArguments& arguments, const WatersResult& result) {
  const std::filesystem::path folder = arguments.output;
  create_folder(folder);
  const std::vector<WatersSummary> summaries = summarise_waters(arguments.options, result);
  const auto write = [&](const char* file, const FileContent::Write& content) {
    write_whole_file(folder / file, content);
  };
  write("waters.csv", [&](std::ostream& out) { write_waters_csv(out, arguments.options, result); });
  write("waters_summary.csv", [&](std::ostream& out) { write_waters_summary_csv(out, summaries); });
  write("waters_histogram.csv", [&](std::ostream& out) {
    write_waters_histogram_csv(out, waters_histograms(arguments.options, result));
  });
  TextTable table(
      "Normalised reduction of the end-to-end bound against the default executor's, percent [95 % interval]",
      {"util", "method", "schedulable", "chains", "median", "mean", "min", "max", "share > 0"});
  for (const WatersSummary& s : summaries) {
    table.add_row({fixed(s.utilisation, 2), to_string(s.method), text("%u/%u", s.schedulable, s.sets),
                   std::to_string(s.chains), with_interval(s.median), with_interval(s.mean), fixed(s.min, 2),
                   fixed(s.max, 2), fixed(s.positive_share.value, 4)});
  }
  std::cout << table;
  draw_figure("waters", folder);
  std::cout << "\nResults: " << folder.string() << "\n";
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

void add_waters_experiment(CLI::App& experiment) {
  auto arguments = std::make_shared<WatersArguments>();
  CLI::App* waters =
      experiment.add_subcommand("waters", "Section VII-B: end-to-end bounds on WATERS 2015 task sets");
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
