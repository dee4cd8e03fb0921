// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "advise/phase_evaluator.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath::advise {

/// First timestamps by task; 0 for subscriptions.
using FirstTimestamps = std::vector<Duration>;

struct PhaseSearchOptions {
  unsigned threads = 0;  ///< 0: one for each processor. The result does not depend on it.
  /// Asked between evaluations: whether to end with the best phases so far.
  std::function<bool()> stop = [] { return false; };
};

struct FoundPhases {
  FirstTimestamps first;  ///< Each less than the timer's period.
  PhaseScore score;
  std::size_t evaluations = 0;  ///< Different choices of phases.
  bool complete = true;         ///< Not ended by PhaseSearchOptions::stop.
};

/// The phases that matter for a timer: shifting it by its range changes no distance to a job of another
/// timer, since two timers repeat their distances modulo the greatest common divisor of their periods.
/// `moved` are timers that move together, by the same time.
[[nodiscard]] Duration range_of_phases(const TaskSet& set, const std::vector<TaskId>& moved);

/// The score of phases. It may be too small if it is greater than `enough`, since such phases are not taken.
using ScorePhases = std::function<PhaseScore(const FirstTimestamps&, const PhaseScore& enough)>;

/// Searches phases with a small score. From each of `starts`, a coordinate descent moves one timer after the
/// other, and the timers of `together` as one, over a grid of sixteenths of their ranges; from the best of
/// the ends it goes on with grids of a quarter of the step each. Among equally good neighbouring grid points,
/// it takes the middle, where offsets may be off by most. Deterministic, unless `stop` ends it. `starts` must
/// not be empty; `evaluate` may be called by several threads at once.
[[nodiscard]] FoundPhases search_phases(const TaskSet& set, const std::vector<TaskId>& together,
                                        const std::vector<FirstTimestamps>& starts,
                                        const ScorePhases& evaluate, const PhaseSearchOptions& options);

}  // namespace hotpath::advise
