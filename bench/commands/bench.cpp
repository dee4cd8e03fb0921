// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/json_fields.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"

namespace hotpath {

namespace {

/// As hotpath_report/bench_suite.py takes it.
struct SuiteOptions {
  std::vector<std::string> programs, compare;
  std::uint32_t repetitions = 5;
  std::uint64_t seed = 1;
  bool quick = false;
  double time_out_s = 1200;  ///< Of one program.
  std::string output;
};
HOTPATH_JSON_FIELDS(SuiteOptions, programs, compare, repetitions, seed, quick, time_out_s, output);

}  // namespace

void add_bench_command(CLI::App& app) {
  auto [bench, o] = add_command<SuiteOptions>(
      app, "bench", "Measure what executors and transports cost, or compare two such runs",
      "hotpath bench --output before", [](const SuiteOptions& options) {
        if (!options.output.empty()) check_output_folder(options.output);
        become_python_tool("bench", {nlohmann::json(options).dump()});
      });
  bench.add_flag("--quick", o.quick, "A short look: fewer sizes, shorter runs, once");
  add_number(bench, "--repetitions", o.repetitions, {1, 100}, "N",
             "Runs of each benchmark program, each in a new process");
  add_list(bench, "--only", o.programs, "NAMES",
           "Some of scheduler, simulator, executor, transport,\nhot_path; by default all");
  add_number(bench, "--seed", o.seed, kAnySeed, "N", "Decides the order of programs");
  add_number(bench, "--time-out", o.time_out_s, {1, 86400}, "SECONDS",
             "A program that runs longer than this has hung and is ended");
  add_text(bench, "--output", o.output, "FOLDER", "Folder of the results; by default runs/DATE-bench");
  add_text(bench, "--compare", o.compare, "OLD NEW",
           "Measure nothing: say which values of the folder NEW\ndiffer from those of OLD, and by how much")
      ->expected(2);
  exclude(bench, "--quick", {"--repetitions"});
  exclude(bench, "--compare", {"--quick", "--repetitions", "--only", "--seed", "--time-out", "--output"});
}

}  // namespace hotpath
