// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace hotpath::exact {

/// Integer arithmetic on nanoseconds without wrap-around: every function throws AnalysisError if
/// the result leaves the 64-bit range (292 years).
[[noreturn]] void report_overflow();
[[noreturn]] void report_slow_convergence();

inline std::int64_t add(std::int64_t a, std::int64_t b) {
  std::int64_t r;
  if (__builtin_add_overflow(a, b, &r)) report_overflow();
  return r;
}
inline std::int64_t subtract(std::int64_t a, std::int64_t b) {
  std::int64_t r;
  if (__builtin_sub_overflow(a, b, &r)) report_overflow();
  return r;
}
inline std::int64_t multiply(std::int64_t a, std::int64_t b) {
  std::int64_t r;
  if (__builtin_mul_overflow(a, b, &r)) report_overflow();
  return r;
}
/// a / b rounded up and down; a >= 0, b > 0.
inline std::int64_t ceil_div(std::int64_t a, std::int64_t b) {
  assert(a >= 0 && b > 0);
  return a / b + (a % b != 0);
}
inline std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  assert(a >= 0 && b > 0);
  return a / b;
}
/// Least common multiple of positive numbers.
std::int64_t lcm(std::int64_t a, std::int64_t b);

/// Sum of fractions C_i / T_i, compared with 1 without rounding.
class Utilisation {
 public:
  /// wcet >= 0, period > 0.
  void add(std::int64_t wcet, std::int64_t period);
  /// Negative, zero or positive: below, equal to or above 1. Throws AnalysisError if the sum is
  /// within 1e-16 of 1 and its exact fraction does not fit into 128 bits.
  int compare_to_one() const;
  /// For messages only.
  double value() const;

 private:
  struct Fraction {
    std::int64_t wcet, period;
  };
  std::vector<Fraction> terms_;
  // The sum times 2^62, rounded down and up term by term.
  __extension__ typedef __int128 Wide;
  Wide lower_ = 0, upper_ = 0;
};

/// Number of steps after which a fixed point counts as unreachable (the utilisation is close to 1).
inline constexpr std::uint64_t kMaxSteps = 20'000'000;

/// Least w >= start with f(w) <= w, for non-decreasing f with f(start) >= start; std::nullopt if it
/// exceeds `limit`.
template <typename Function>
std::optional<std::int64_t> least_fixed_point(std::int64_t start, Function&& f,
                                              std::int64_t limit = std::numeric_limits<std::int64_t>::max()) {
  std::int64_t w = start;
  for (std::uint64_t step = 0; step < kMaxSteps; ++step) {
    if (w > limit) return std::nullopt;
    const std::int64_t next = f(w);
    if (next <= w) return w;
    w = next;
  }
  report_slow_convergence();
}

}  // namespace hotpath::exact
