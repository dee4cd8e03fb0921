// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath {

/// The relation between the repetitions of the two sides.
enum class Pairing {
  independent,  ///< Independent repetitions. Welch's test (1947).
  paired,       ///< Repetition i had the same conditions on both sides, with noise. Student's test of the
                ///< differences.
  exact,        ///< Paired without noise: simulations with equal seeds. See test_growth().
};

/// The meaning of a difference, and the kind of average.
enum class Scale {
  difference,  ///< Counts: arithmetic mean; growth is a difference.
  ratio,       ///< Positive values: geometric mean; growth is a factor.
};

/// Whether a measure grew from one side to the other. All values use the unit of the scale.
struct GrowthTest {
  double before = kNoValue;  ///< Mean of the repetitions; geometric for ratios.
  double after = kNoValue;
  double growth = kNoValue;  ///< From `before` to `after`: difference or factor.
  Interval interval;         ///< 95 % confidence interval of the growth; NaN with too few repetitions.
  double p_value = 1;        ///< One-sided: probability of at least this growth if nothing grew.
  bool exact = false;        ///< Decided without statistics: the p-value is 0 or 1.
  /// Of the difference; for ratios, of the difference of logarithms.
  double standard_error = 0, degrees_of_freedom = kNoValue;
};

/// Tests `before` against `after`: one value per repetition, equally many on both sides if they are
/// paired. With Pairing::exact a measure that grew in every pair has grown, and a measure that grew
/// in no pair has not; if pairs disagree, Student's test decides about the overall growth. If
/// values do not vary at all, their difference decides. Noisy counts are the exception: a few equal
/// counts do not prove that counts never vary, so they get the variance of rounding. Requires at
/// least one value per side.
GrowthTest test_growth(std::span<const double> before, std::span<const double> after, Pairing pairing,
                       Scale scale);

/// The smallest growth that such repetitions detect with probability `power` at the false alarm
/// rate `alarm_rate`, if they vary like the repetitions of `test`. Without noise: 0, or the factor
/// 1.
double detectable_growth(const GrowthTest& test, Scale scale, double alarm_rate, double power);

/// Adjusts p-values for multiple tests (Holm 1979): the probability of any false alarm among the
/// values below a rate is at most that rate.
std::vector<double> holm(std::span<const double> p_values);

}  // namespace hotpath
