// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// Counts the primes in [2, limit] by full trial division, as upstream's number_cruncher.hpp: work that
/// depends on `limit` alone. 2 for limits up to 2.
std::int64_t count_primes(std::uint32_t limit);

/// As count_primes, but stops after the candidate during which `clock` reaches `until`.
std::int64_t count_primes_until(std::uint32_t limit, Time until, Time (*clock)());

/// How long the number cruncher takes on this machine.
struct Calibration {
  double divisions_per_us = 0;  ///< Trial divisions a microsecond.
  double spread_percent = 0;    ///< Distance of the two readings that were kept.
  unsigned readings = 0;        ///< Readings taken until two agreed.
  bool disturbed = false;       ///< No two consecutive readings agreed within kCalibrationTolerancePercent.
};

inline constexpr double kCalibrationTolerancePercent = 2.0;

/// Reads the speed of the calling thread's processor with crunches of about `typical` until two consecutive
/// readings agree, at most ten times; each reading is the median of a few crunches: single interruptions do
/// not count, but what slows this machine down most of the time does, as it will during the run.
Calibration calibrate(Duration typical);

/// Turns execution times into limits of count_primes.
class CrunchScale {
 public:
  explicit CrunchScale(const Calibration& calibration);

  /// Limit whose work takes `duration`, to within half a candidate (about 5 us at 4 ms). 0 for no work at
  /// all.
  [[nodiscard]] std::uint32_t limit(Duration duration) const;

  /// Trial divisions of count_primes(limit).
  static std::uint64_t divisions(std::uint32_t limit);

 private:
  double divisions_per_us_;
};

}  // namespace hotpath
