// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
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
    return nlohmann::json::parse(in);
  } catch (const nlohmann::json::exception& error) {
    throw UsageError("--compare: " + path + " was not written by `hotpath bench`: " + error.what());
  }
}

void compare(const std::string& before, const std::string& after) {
  const BenchValues old_values = read_folder(before), new_values = read_folder(after);
  const auto comparisons = compare_values(old_values, new_values);
  if (comparisons.empty()) {
    throw UsageError("--compare: " + before + " and " + after + " have no value in common");
  }
  write_comparison(std::cout, comparisons);
  const auto unknown = std::ranges::count(comparisons, Verdict::not_comparable, &ValueComparison::verdict);
  if (unknown > 0) {
    std::cerr << "note: " << unknown << " values are not comparable: each side needs " << kLeastRepetitions
              << " repetitions and values above zero.\n";
  }
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto [bench, o] = add_command<Arguments>(
      app, "bench", "Measure what executors and transports cost, or compare two such runs",
      "hotpath bench --output before", [](const Arguments& a) {
        a.compare.empty() ? run_suite(a.suite) : compare(a.compare[0], a.compare[1]);
      });
  bench.add_flag("--quick", o.suite.quick, "A short look: fewer sizes, shorter runs, once");
  add_number(bench, "--repetitions", o.suite.repetitions, 1, 100, "N",
             "Runs of each benchmark program, each in a new process");
  add_text(bench, "--only", o.suite.programs, "NAMES",
           "Some of scheduler, simulator, executor, transport,\nhot_path; by default all")
      ->delimiter(',')
      ->check(CLI::IsMember(bench_programs()).description(""));
  add_text(bench, "--seed", o.suite.seed, "N", "Decides the order of programs");
  add_number(bench, "--time-out", o.suite.time_out_s, 1, 86400, "SECONDS",
             "A program that runs longer than this has hung and is ended");
  add_text(bench, "--output", o.suite.output, "FOLDER", "Folder of the results; by default runs/DATE-bench");
  add_text(bench, "--compare", o.compare, "OLD NEW",
           "Measure nothing: say which values of the folder NEW\ndiffer from those of OLD, and by how much")
      ->expected(2);
}

}  // namespace hotpath
