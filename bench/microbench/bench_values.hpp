// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

namespace hotpath {

/// What the benchmark programs measured: for each benchmark and metric one value per repetition. The metric
/// `time_ns` is Google Benchmark's own time per iteration; units are the endings of names.
struct BenchValues {
  using Key = std::pair<std::string, std::string>;  ///< Benchmark, metric.
  std::map<Key, std::vector<double>> values;

  /// Growth with the number of tasks or jobs, as Google Benchmark fits it.
  struct Complexity {
    std::string benchmark, order;  ///< `lgN`, `N` and so on.
    double coefficient_ns = 0;     ///< Time per unit of that order.
    double rms_percent = 0;        ///< Root mean square error of the fit.
  };
  std::vector<Complexity> complexities;  ///< Of the last repetition.
  std::vector<std::string> errors;       ///< Benchmarks that failed, with the reason.
};

/// Adds what one run of a program wrote with --benchmark_out_format=json. Throws std::invalid_argument when
/// it is not that.
void add_google_benchmark_output(BenchValues& bench, const nlohmann::json& output);

/// As in bench.json; the second throws std::invalid_argument that says what is missing.
nlohmann::json to_json(const BenchValues& bench);
BenchValues bench_values_from_json(const nlohmann::json& content);

}  // namespace hotpath
