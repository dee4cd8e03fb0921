// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/enum_text.hpp"

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
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(Complexity, benchmark, order, coefficient_ns, rms_percent)
  };
  std::vector<Complexity> complexities;  ///< Of the last repetition.
  std::vector<std::string> errors;       ///< Benchmarks that failed, with the reason.
};

/// Adds what one run of a program wrote with --benchmark_out_format=json. Throws when it is not that.
void add_google_benchmark_output(BenchValues& bench, const nlohmann::json& output);

/// As in bench.json; the second throws nlohmann's exceptions for what is none.
void to_json(nlohmann::json& j, const BenchValues& bench);
void from_json(const nlohmann::json& j, BenchValues& bench);

/// Repetitions that each side needs before a difference can be called one. Fewer have no interval worth the
/// name.
inline constexpr std::size_t kLeastRepetitions = 3;

/// Confidence of the intervals: of a thousand values that have not changed, a few still seem to.
inline constexpr double kCompareConfidence = 0.99;

enum class Verdict : std::uint8_t {
  within_noise,
  smaller,        ///< Beyond noise.
  larger,         ///< Beyond noise.
  not_comparable  ///< Too few repetitions, or values that have no ratio.
};
constexpr auto enum_texts(Verdict) {
  return std::to_array<EnumText<Verdict>>({{Verdict::within_noise, "within noise"},
                                           {Verdict::smaller, "smaller"},
                                           {Verdict::larger, "larger"},
                                           {Verdict::not_comparable, "not comparable"}});
}

/// One value before and after a change.
struct ValueComparison {
  std::string benchmark, metric;
  double before = kNoValue, after = kNoValue;  ///< Medians over repetitions.
  Estimate ratio;                              ///< after / before, with its bootstrap interval.
  Verdict verdict = Verdict::not_comparable;
};

/// All values that both have. The same seed gives the same intervals.
std::vector<ValueComparison> compare_values(const BenchValues& before, const BenchValues& after,
                                            std::uint64_t seed = 1);

/// A line for each value, those beyond noise first and the largest effects first among them, and a count.
void write_comparison(std::ostream& out, const std::vector<ValueComparison>& comparisons);

}  // namespace hotpath
