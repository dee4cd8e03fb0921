// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/number_cruncher.hpp"

namespace hotpath {

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
