// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/exact.hpp"

#include <numeric>

#include "hotpath/analysis/analysis_error.hpp"

namespace hotpath::exact {

namespace {

__extension__ typedef __int128 Wide;
constexpr Wide kOne = Wide{1} << 62;

Wide wide_gcd(Wide a, Wide b) {
  while (b != 0) {
    const Wide rest = a % b;
    a = b;
    b = rest;
  }
  return a;
}

}  // namespace

void report_overflow() {
  throw AnalysisError(
      "the times of this task set exceed 64-bit nanoseconds (292 years) within the computation; use smaller "
      "execution times, periods or jitter");
}

void report_slow_convergence() {
  throw AnalysisError(
      "a fixed point was not reached within " + std::to_string(kMaxSteps) +
      " steps because the utilisation is close to 1; lower it, or round the periods to a common divisor");
}

std::int64_t lcm(std::int64_t a, std::int64_t b) { return multiply(a / std::gcd(a, b), b); }

void Utilisation::add(std::int64_t wcet, std::int64_t period) {
  assert(wcet >= 0 && period > 0);
  terms_.push_back({wcet, period});
  const Wide scaled = Wide{wcet} << 62;
  lower_ += scaled / period;
  upper_ += scaled / period + (scaled % period != 0);
}

int Utilisation::compare_to_one() const {
  if (upper_ < kOne) return -1;
  if (lower_ > kOne) return 1;
  if (lower_ == kOne && upper_ == kOne) return 0;
  // Close to 1: compute the exact sum as a reduced fraction.
  Wide numerator = 0, denominator = 1;
  for (const Fraction& f : terms_) {
    const Wide common = wide_gcd(denominator, f.period);
    Wide grown, left, right;
    if (__builtin_mul_overflow(denominator, Wide{f.period} / common, &grown) ||
        __builtin_mul_overflow(numerator, Wide{f.period} / common, &left) ||
        __builtin_mul_overflow(Wide{f.wcet}, denominator / common, &right) ||
        __builtin_add_overflow(left, right, &numerator)) {
      throw AnalysisError(
          "the utilisation is so close to 1 that 128-bit arithmetic cannot tell on which side; change an "
          "execution time by a nanosecond");
    }
    const Wide shared = wide_gcd(numerator, grown);
    numerator /= shared;
    denominator = grown / shared;
  }
  return numerator < denominator ? -1 : numerator > denominator ? 1 : 0;
}

double Utilisation::value() const {
  double sum = 0;
  for (const Fraction& f : terms_) sum += static_cast<double>(f.wcet) / static_cast<double>(f.period);
  return sum;
}

}  // namespace hotpath::exact
