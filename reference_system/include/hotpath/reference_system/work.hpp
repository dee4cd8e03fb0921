// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/number_cruncher.hpp"

namespace hotpath {

/// The work of one callback's jobs.
class Work {
 public:
  Work(WorkMode mode, Duration duration, const CrunchScale& scale)
      : mode_(mode), duration_(duration), limit_(mode == WorkMode::fixed ? scale.limit(duration) : 0) {}

  /// Spends the execution time in the calling thread, for a job that started at `start`; returns
  /// the result of the number cruncher.
  [[nodiscard]] std::int64_t burn(Time start) const;

 private:
  WorkMode mode_;
  Duration duration_;
  std::uint32_t limit_;  ///< Of count_primes(), for WorkMode::fixed.
};

/// The part of a job up to an instant at which it publishes, or to its end.
struct WorkPart {
  double end = 1;  ///< Share of the execution time at its end.
  Work work;
};
/// The parts of a callback's jobs, in order; the last one ends with the job.
[[nodiscard]] std::vector<WorkPart> parts_of(WorkMode mode, const Callback& callback,
                                             const CrunchScale& scale);

}  // namespace hotpath
