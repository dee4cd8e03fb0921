// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "program/json_record.hpp"

namespace hotpath::commands {

namespace {

/// The input of hotpath_report/bench_suite.py.
struct SuiteOptions {
  std::vector<std::string> programs;
  std::uint32_t repetitions = 5;
  std::uint64_t seed = 1;
  bool quick = false;
  double time_out_s = 1200;  ///< Per program.
  std::string output;
};
HOTPATH_FIELDS(SuiteOptions, programs, repetitions, seed, quick, time_out_s, output);

}  // namespace

const Command kBench("Measure", 20, [](CLI::App& app) {
  auto [bench, o] =
      add_command<SuiteOptions>(app, "bench", "Benchmark executors and transports",
                                "hotpath bench --output before", [](const SuiteOptions& options) {
                                  if (!options.output.empty()) program::check_output_folder(options.output);
                                  program::become_python_tool("bench", {nlohmann::json(options).dump()});
                                });
  add(bench, "--quick", o.quick, "Short run: fewer sizes, shorter measurements, 1 repetition");
  add(bench, "--repetitions", o.repetitions, {1, 100}, "N",
      "Runs of each benchmark program, each in a new process");
  add_list(bench, "--only", o.programs, "NAMES",
           "Benchmarks to run, separated by commas: scheduler, simulator, executor, transport, hot_path; by "
           "default all");
  add(bench, "--seed", o.seed, kAnySeed, "N", "Seed of the order of programs");
  add(bench, "--time-out", o.time_out_s, {1, 86400}, "SECONDS",
      "Time limit of each program; a slower one has hung and is\nkilled");
  add(bench, "--output", o.output, "FOLDER", "New folder for the results; by default runs/DATE-bench");
  bench.get_option("--quick")->excludes("--repetitions");
});

}  // namespace hotpath::commands
