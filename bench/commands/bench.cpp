// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "microbench/bench_suite.hpp"
#include "microbench/bench_values.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

struct Arguments {
  SuiteOptions suite;
  std::vector<std::string> compare;
};

BenchValues read_folder(const std::string& folder) {
  const std::string path = folder + "/bench.json";
  std::ifstream in(path);
  if (!in)
    throw UsageError("--compare: " + path + " cannot be read; name a folder written by `hotpath bench`");
  try {
    return bench_values_from_json(nlohmann::json::parse(in));
  } catch (const std::exception& error) {
    throw UsageError("--compare: " + path + ": " + error.what());
  }
}

void compare(const std::string& before, const std::string& after) {
  const BenchValues old_values = read_folder(before), new_values = read_folder(after);
  const auto comparisons = compare_values(old_values, new_values);
  if (comparisons.empty()) {
    throw UsageError("--compare: " + before + " and " + after + " have no value in common");
  }
  write_comparison(std::cout, comparisons);
  const auto unknown = std::count_if(comparisons.begin(), comparisons.end(), [](const ValueComparison& c) {
    return c.verdict == Verdict::not_comparable;
  });
  if (unknown > 0) {
    std::cerr << "note: " << unknown << " values are not comparable: each side needs " << kLeastRepetitions
              << " repetitions and values above zero.\n";
  }
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  SuiteOptions& suite = arguments->suite;
  CLI::App* bench =
      app.add_subcommand("bench", "Measure what executors and transports cost, or compare two such runs");
  bench->add_flag("--quick", suite.quick, "A short look: fewer sizes, shorter runs, once");
  bench
      ->add_option("--repetitions", suite.repetitions,
                   "Runs of each benchmark program, each in a new process")
      ->type_name("N")
      ->check(CLI::Range(1, 100).description(""))
      ->capture_default_str();
  bench
      ->add_option("--only", suite.programs,
                   "Some of scheduler, simulator, executor, transport,\nhot_path; by default all")
      ->type_name("NAMES")
      ->delimiter(',')
      ->check(CLI::IsMember(bench_programs()).description(""));
  bench->add_option("--seed", suite.seed, "Decides the order of programs")
      ->type_name("N")
      ->capture_default_str();
  bench
      ->add_option("--time-out", suite.time_out_s,
                   "A program that runs longer than this has hung and is ended")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 86400.0).description(""))
      ->capture_default_str();
  bench->add_option("--output", suite.output, "Folder of the results; by default runs/DATE-bench")
      ->type_name("FOLDER");
  bench
      ->add_option(
          "--compare", arguments->compare,
          "Measure nothing: say which values of the folder NEW\ndiffer from those of OLD, and by how much")
      ->type_name("OLD NEW")
      ->expected(2);
  bench->footer("Example:  hotpath bench --output before");
  bench->callback([arguments] {
    if (!arguments->compare.empty()) {
      compare(arguments->compare[0], arguments->compare[1]);
    } else {
      run_suite(arguments->suite);
    }
  });
}

}  // namespace hotpath
