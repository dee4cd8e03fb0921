// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "comparison/sides.hpp"
#include "hotpath/analysis/growth_test.hpp"

namespace hotpath::comparison {

enum class Verdict : std::uint8_t { worse, better, same, not_comparable };
constexpr auto enum_texts(Verdict) {
  return texts_in_order<Verdict>({"worse", "better", "no difference beyond noise", "not comparable"});
}

/// The probability of any false alarm, and of finding a detectable growth.
inline constexpr double kAlarmRate = 0.01, kPower = 0.9;

/// One comparison. Latencies grow by a ratio, counts per repetition by a difference.
struct Judgement {
  std::string what;
  Measure measure{};
  GrowthTest test;
  double detectable = 0;  ///< The smallest growth that these repetitions can show.
  Pairing pairing{};
  bool simulated = false;
  double adjusted = 1;    ///< The p-value of growth or, if it shrank, of that; corrected for all comparisons.
  bool dried_up = false;  ///< A repetition has hardly any of its outputs or jobs, or is missing.
  bool sprang_up = false;  ///< The opposite.
  bool shrank = false;     ///< It is not worse, and the sides, swapped, would be.

  [[nodiscard]] bool counted() const { return measure >= Measure::losses; }
  /// Whether simulated pairs agree, which rules out noise.
  [[nodiscard]] bool exact() const { return pairing == Pairing::exact && test.exact; }
  /// Growth of a latency in percent, and the smallest one that raises an alarm; 0: any.
  [[nodiscard]] double percent() const { return 100 * (test.growth - 1); }
  [[nodiscard]] double detectable_percent() const;
  [[nodiscard]] bool worse() const;
  [[nodiscard]] Verdict verdict() const;
};

/// Compares two sides. The unit is the repetition: its mean, median and p99 latency and its losses are
/// tested by test_growth(). Simulated repetitions with equal draws (seed, phases, execution times, length)
/// are pairs without noise. Live repetitions are pairs if both sides were measured by turns
/// (`interleaved`); all others are independent. Holm's correction keeps the probability of any false alarm
/// below kAlarmRate. A chain or task whose outputs or jobs more than halve in a repetition is worse without
/// a test; jobs are reported only if they more than halve or double. A measure is better if the sides,
/// swapped, were judged worse. Throws UsageError for too few repetitions.
[[nodiscard]] std::vector<Judgement> judge(const Side& before, const Side& after, bool interleaved);

}  // namespace hotpath::comparison
