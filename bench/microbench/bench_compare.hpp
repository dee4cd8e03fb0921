// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "microbench/bench_values.hpp"
#include "hotpath/analysis/statistics.hpp"

namespace hotpath {

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
const char* to_string(Verdict);

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
