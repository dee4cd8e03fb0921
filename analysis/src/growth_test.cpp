// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/growth_test.hpp"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <numeric>

namespace hotpath {
namespace {

using StudentsT = boost::math::students_t;

/// Differences below this are rounding: for logarithms 1e-9 is a billionth; counts are whole
/// numbers.
constexpr double kRounding = 1e-9;
constexpr double kTail = 0.025;
/// Variance of whole numbers that represent all values half a unit around them.
constexpr double kLeastCountVariance = 1.0 / 12;

struct Moments {
  double n = 0, mean = 0, variance = 0;  ///< Sample variance; 0 for a single value.
};

Moments moments(const std::vector<double>& values, double least_variance) {
  Moments m;
  m.n = static_cast<double>(values.size());
  m.mean = std::accumulate(values.begin(), values.end(), 0.0) / m.n;
  for (const double v : values) m.variance += (v - m.mean) * (v - m.mean) / std::max(m.n - 1, 1.0);
  m.variance = std::max(m.variance, least_variance);
  return m;
}

std::vector<double> scaled(std::span<const double> values, Scale scale) {
  std::vector<double> result(values.begin(), values.end());
  if (scale == Scale::ratio) {
    for (double& v : result) v = std::log(v);
  }
  return result;
}

double unscaled(double value, Scale scale) { return scale == Scale::ratio ? std::exp(value) : value; }

/// The standard error of a difference, and its degrees of freedom.
struct Spread {
  double error = 0, degrees = kNoValue;
};

Spread spread_of_two(const Moments& a, const Moments& b) {
  const double of_a = a.variance / a.n, of_b = b.variance / b.n, both = of_a + of_b;
  const double denominator = of_a * of_a / (a.n - 1) + of_b * of_b / (b.n - 1);
  return {std::sqrt(both), both * both / denominator};
}

/// Whether pairs without noise agree, so that no test is needed.
bool agree(const std::vector<double>& differences) {
  const auto grew = std::ranges::count_if(differences, [](double d) { return d > kRounding; });
  return grew == 0 || grew == static_cast<std::ptrdiff_t>(differences.size());
}

}  // namespace

GrowthTest test_growth(std::span<const double> before, std::span<const double> after, Pairing pairing,
                       Scale scale) {
  assert(!before.empty() && !after.empty());
  assert(pairing == Pairing::independent || before.size() == after.size());
  const std::vector<double> a = scaled(before, scale), b = scaled(after, scale);
  const bool noisy_counts = scale == Scale::difference && pairing != Pairing::exact;
  const double least_variance = noisy_counts ? kLeastCountVariance : 0;
  const Moments of_a = moments(a, least_variance), of_b = moments(b, least_variance);
  const double difference = of_b.mean - of_a.mean;
  Spread spread;
  bool exact = false;
  if (pairing == Pairing::independent) {
    spread = spread_of_two(of_a, of_b);
  } else {
    std::vector<double> differences(a.size());
    std::transform(b.begin(), b.end(), a.begin(), differences.begin(), std::minus<>());
    const Moments m = moments(differences, 2 * least_variance);
    spread = {std::sqrt(m.variance / m.n), m.n - 1};
    exact = pairing == Pairing::exact && agree(differences);
  }
  exact = exact || spread.error < kRounding;

  GrowthTest test;
  test.before = unscaled(of_a.mean, scale);
  test.after = unscaled(of_b.mean, scale);
  test.growth = unscaled(difference, scale);
  test.exact = exact;
  if (exact) {
    test.p_value = difference > kRounding ? 0 : 1;
    return test;
  }
  const StudentsT distribution(spread.degrees);
  test.p_value = cdf(complement(distribution, difference / spread.error));
  const double reach = quantile(complement(distribution, kTail)) * spread.error;
  test.interval = {unscaled(difference - reach, scale), unscaled(difference + reach, scale)};
  test.standard_error = spread.error;
  test.degrees_of_freedom = spread.degrees;
  return test;
}

double detectable_growth(const GrowthTest& test, Scale scale, double alarm_rate, double power) {
  if (test.exact) return unscaled(0, scale);
  // Johnson and Welch's (1940) approximation of the noncentral t distribution.
  const double degrees = test.degrees_of_freedom;
  const double critical = quantile(complement(StudentsT(degrees), alarm_rate));
  const double steps =
      critical * (1 - 1 / (4 * degrees)) +
      quantile(boost::math::normal(), power) * std::sqrt(1 + critical * critical / (2 * degrees));
  return unscaled(steps * test.standard_error, scale);
}

std::vector<double> holm(std::span<const double> p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](std::size_t i) { return p_values[i]; });
  std::vector<double> adjusted(p_values.size());
  double largest = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(order.size() - k) * p_values[order[k]]));
    adjusted[order[k]] = largest;
  }
  return adjusted;
}

}  // namespace hotpath
