// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/time.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Counts the primes in [2, limit] by full trial division (upstream's number_cruncher.hpp): the
/// work depends only on `limit`. Returns 2 for limits up to 2.
std::int64_t count_primes(std::uint32_t limit);

/// Counts primes from `now`, a reading of `clock`, until `clock` reaches `until`. Reads the clock
/// after each `between_reads` of work, which it estimates from the work done between the last two
/// readings, and after the work that is estimated to be left. Zero: after each candidate.
std::int64_t count_primes_until(Time now, Time until, Duration between_reads, Time (*clock)());

/// The speed of the number cruncher on this machine.
struct Calibration {
  double divisions_per_us = 0;  ///< Trial divisions per microsecond.
  double spread_percent = 0;    ///< Difference of the two readings that were kept.
  unsigned readings = 0;        ///< Readings taken until two agreed.
  bool disturbed = false;       ///< No two consecutive readings agreed within kCalibrationTolerancePercent.
};

inline constexpr double kCalibrationTolerancePercent = 2.0;

/// Measures the speed of the calling thread's processor with crunches of about `typical`, until two
/// consecutive readings agree, at most ten times. Each reading is the median of a few crunches, so
/// single interruptions do not count. Slowdowns that last most of the time do count, because they
/// will also affect the run.
Calibration calibrate(Duration typical);

/// The limit of count_primes() whose work takes `duration` at a calibrated speed, to within half a candidate
/// (about 5 us at 4 ms). 0: no work.
[[nodiscard]] std::uint32_t crunch_limit(Duration duration, double divisions_per_us);

/// The work of a callback's jobs up to an instant at which they publish, or to their end.
struct WorkPart {
  double end = 1;  ///< Share of the execution time at its end, in [0, 1].
  WorkMode mode = WorkMode::fixed;
  Duration duration{};      ///< WorkMode::wall: since the start of the job; otherwise of this part alone.
  std::uint32_t limit = 0;  ///< Of count_primes(), for WorkMode::fixed.

  /// Works in the calling thread, for a job that started at `start`; returns the result of the number
  /// cruncher.
  [[nodiscard]] std::int64_t burn(Time start) const;
};
/// The parts of a callback's jobs, in order; the last one ends with the job.
[[nodiscard]] std::vector<WorkPart> parts_of(WorkMode mode, const Callback& callback,
                                             double divisions_per_us);

}  // namespace hotpath
