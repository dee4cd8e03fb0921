// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath {

/// How the repetitions of two sides belong together.
enum class Pairing {
  independent,  ///< Not at all. Welch's test (1947).
  paired,  ///< Repetition i of both met the same conditions, with noise. Student's test of the differences.
  exact,   ///< The same without noise: simulations of equal seeds. See test_growth().
};

/// What a difference means, and what is averaged.
enum class Scale {
  difference,  ///< Counts: mean, and by how much it grew.
  ratio,       ///< Positive values: geometric mean, and by which factor it grew.
};

/// Whether a measure grew from one side to the other. All values are in the scale's unit.
struct GrowthTest {
  double before = kNoValue;  ///< Mean of the repetitions; geometric for ratios.
  double after = kNoValue;
  double growth = kNoValue;  ///< From the one to the other: difference or factor.
  Interval interval;         ///< Of the growth, 95 %; NaN where there are too few repetitions.
  double p_value = 1;        ///< One-sided: probability of so much growth if nothing grew.
  bool exact = false;        ///< Decided without statistics: the p-value is 0 or 1.
  double standard_error = 0,
         degrees_of_freedom = kNoValue;  ///< Of the difference (of logarithms for ratios).
};

/// Tests `before` against `after`: one value for each repetition, equally many if they are paired. With
/// Pairing::exact a measure that grew in every pair has grown, and one that grew in none has not; only where
/// pairs disagree, Student's test decides whether it grew on the whole. Values that do not vary at all are
/// decided by their difference, but for counts with noise: few equal ones do not show that they never vary,
/// and have the variance of rounding. At least one value on each side.
GrowthTest test_growth(std::span<const double> before, std::span<const double> after, Pairing pairing,
                       Scale scale);

/// The smallest growth that such repetitions show with probability `power` at the rate `alarm_rate` of false
/// alarms, if they vary as those of `test` do; 0, or the factor 1, without noise.
double detectable_growth(const GrowthTest& test, Scale scale, double alarm_rate, double power);

/// Adjusts p-values so that all those below a rate are false alarms with at most that probability together
/// (Holm 1979).
std::vector<double> holm(std::span<const double> p_values);

}  // namespace hotpath
