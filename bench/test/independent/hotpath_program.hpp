// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "simulation.hpp"

namespace independent {

/// Executors with one thread, with their variants.
inline const std::vector<std::string> kExecutors = {
    "default",     "static",      "static-jazzy", "events-ro", "cbg:1",  "cbg-3178:1",
    "rm-ro",       "rm-ro:first", "rm-ro:fifo",   "dm-ro",     "edf-ro", "edf-ro:first",
    "edf-ro:fifo", "fp-ro",       "fp-ro:first",  "fp-ro:fifo"};

std::string joined(const std::vector<std::string>& items);

/// Runs a command line with its output in a file. Returns whether it succeeded.
bool run_command(const std::string& line, const std::string& output);

/// What a stored run contains of one executor.
using StoredRun = std::map<std::string, Result>;
StoredRun read_run(const Graph& graph, const std::string& folder);

/// One row of `hotpath analyze --csv` with a bound.
struct Bound {
  std::string executor, method, kind, name;
  Nanoseconds value = 0;
  bool exact = false;
};
std::vector<Bound> read_bounds(const std::string& file);

/// Kind (`task`, `chain`, `hot_path`) and name of a bounded value.
using Target = std::pair<std::string, std::string>;

/// The largest value of each target. `duplicates`: also of outputs with several jobs of one source.
std::map<Target, Nanoseconds> largest(const Graph& graph, const Result& result, bool duplicates);

/// Checks the graphs of these seeds with the program and in the folder that the arguments name;
/// HOTPATH_CASES: how many.
template <class Check>
int run_check(int count, const char* const* arguments) {
  if (count != 5) {
    std::cerr << "usage: " << arguments[0] << " HOTPATH FOLDER FIRST_SEED GRAPHS\n";
    return 2;
  }
  std::filesystem::create_directories(arguments[2]);
  Check check(arguments[1], arguments[2]);
  const char* const cases = std::getenv("HOTPATH_CASES");
  const std::uint64_t first = std::stoull(arguments[3]), graphs = std::stoull(cases ? cases : arguments[4]);
  for (std::uint64_t seed = first; seed < first + graphs; ++seed) check.check(seed);
  return check.report();
}

}  // namespace independent
