// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <compare>
#include <functional>
#include <vector>

#include "advise/candidates.hpp"
#include "bounds/bounds.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath::advise {

/// First timestamps by task; 0 for subscriptions.
using FirstTimestamps = std::vector<Duration>;

/// The exact worst cases under one executor for one choice of phases.
struct PhaseValues {
  Phases rule = {};  ///< Of compared phases.
  FirstTimestamps first = {};
  std::optional<std::string> refusal = "not evaluated";  ///< Why there are no values; none: there are.
  /// Of a latency or lateness in ms, or of the greatest age in percent of its limit.
  Score score = {};
  Score within_margin = {};                          ///< The worst score with offsets off by a margin.
  double hot_path_ms = INFINITY, age_ms = INFINITY;  ///< Of the objective's chain; infinite: there is none.
  bool complete = true;                              ///< Of a search: not ended by `stop`.
  [[nodiscard]] bool exact() const { return !refusal; }
};

/// Explores all schedules (exact_worst_cases()), without a margin. `reached`, if given, gets a witness of
/// each value.
[[nodiscard]] PhaseValues exact_values(const Candidate& candidate, const Objective& objective,
                                       const FirstTimestamps& first,
                                       std::vector<bounds::ReachedWorstCase>* reached = nullptr);

/// The phases that matter for a timer: shifting it by its range changes no distance to a job of another
/// timer, since two timers repeat their distances modulo the greatest common divisor of their periods.
/// `moved` are timers that move together, by the same time.
[[nodiscard]] Duration range_of_phases(const TaskSet& set, const std::vector<TaskId>& moved);

/// The values of phases. Called by several threads at once. PhaseValues::within_margin may be too small if it
/// is greater than `enough`, since such phases are not taken.
using EvaluatePhases = std::function<PhaseValues(const FirstTimestamps&, const Score& enough)>;

/// Searches phases with a small PhaseValues::within_margin. From each of `starts`, a coordinate descent moves
/// one timer after the other, and those of `together` as one, over a grid of sixteenths of their ranges; from
/// the best end, over grids of eighths of the step. Of equally good neighbours it takes the middle, where
/// offsets may be off by most. Refused if it was stopped before it evaluated any. Does not depend on
/// `threads` (0: one for each processor).
[[nodiscard]] PhaseValues search_phases(
    const TaskSet& set, const std::vector<TaskId>& together, const std::vector<FirstTimestamps>& starts,
    const EvaluatePhases& evaluate, unsigned threads,
    const std::function<bool()>& stop = [] { return false; });

}  // namespace hotpath::advise
