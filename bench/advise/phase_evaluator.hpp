// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "advise/candidates.hpp"
#include "advise/objective.hpp"
#include "bounds/exact_worst_cases.hpp"

namespace hotpath::advise {

/// How good phases are; smaller is better.
struct PhaseScore {
  double value = std::numeric_limits<double>::infinity();  ///< The objective, as in Score::value.
  std::size_t late_timers = 0;  ///< Timers whose worst response time exceeds their deadline, or is unknown.
  double tie = 0;  ///< Of a latency: the chain's other latency in ms. Otherwise as in Score::tie.
  friend std::partial_ordering operator<=>(const PhaseScore&, const PhaseScore&) = default;
};

/// The exact worst cases under one executor for one choice of phases.
struct PhaseValues {
  std::string refusal;  ///< Why there are none; empty: there are.
  PhaseScore score;
  std::optional<double> hot_path_ms, age_ms;       ///< Of the objective's chain; none: it has no output.
  std::vector<std::optional<Duration>> responses;  ///< By task; timers.
};

/// Throws UsageError for an objective that exact worst cases do not have: a median, p99 or losses, or a chain
/// that does not begin in timers.
void check_guaranteed(const Objective& objective, const Graph& graph);

/// Evaluates phases by the exploration of all schedules (exact_worst_cases()).
class PhaseEvaluator {
 public:
  /// The arguments must outlive it.
  PhaseEvaluator(const Candidate& candidate, const Objective& objective);

  /// `first`: first timestamps by task. `reached`, if given, gets a witness of each value. May be called by
  /// several threads at once.
  [[nodiscard]] PhaseValues at(const std::vector<Duration>& first,
                               std::vector<bounds::ReachedWorstCase>* reached = nullptr) const;

  [[nodiscard]] const Candidate& candidate() const { return candidate_; }

 private:
  [[nodiscard]] PhaseScore score(const PhaseValues& values, const GraphBounds& bounds) const;

  const Candidate& candidate_;
  const Objective& objective_;
  std::vector<std::optional<std::size_t>> rows_;  // by chain of the graph: its place in GraphBounds::chains
};

}  // namespace hotpath::advise
