// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "advise/candidates.hpp"
#include "bounds/bounds.hpp"
#include "hotpath/core/workload.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

/// The result of one candidate's simulations.
struct Prediction {
  const Candidate* candidate = nullptr;
  std::vector<results::Repetition> draws;  ///< Without jobs.
  /// Of all draws, with intervals over them. Samples that a reader must leave out are not `overwritten`.
  results::ExecutorSummary summary;
  double cores_used = 0;                ///< Mean work of the jobs that ran.
  std::optional<std::string> overload;  ///< Why there is no summary; none: there is one.
  /// Of the objective's chain: of Objective::latency(). For any phases, unless it is exact.
  std::optional<bounds::Guarantee> bound;
  bool proven = false;  ///< Of requirements: the bounds of all their chains keep the limits.
  std::string refusal;  ///< Of several threads: why it is not exact, or there is none.

  [[nodiscard]] bool keeps_up() const { return !overload; }
  [[nodiscard]] bool exact() const { return bound && bound->method == bounds::kExactMethod; }
};

/// Simulates all candidates that can keep up, over Options::draws draws of phases and execution times; draw i
/// has the same phases and times for every candidate. Stops after the draw in which Options::budget_s ends,
/// or on interruption, so that all candidates have the same draws, at least one. `title`: of the progress.
/// Results have the tightest bounds that a method covers, do not depend on Options::threads, and
/// are ordered by the objective, the best first: proven ones before all others, overloaded ones last.
[[nodiscard]] std::vector<Prediction> predict(const std::vector<Candidate>& candidates,
                                              const Options& options, const Objective& objective,
                                              const std::string& title);

/// One simulation of a candidate, with its jobs.
struct SimulatedDraw {
  GraphTasks tasks;  ///< With the phases of the draw.
  std::unique_ptr<ExecutionTimes> times;
  results::Repetition repetition = {};
};
/// Draw `d` of a candidate. Throws SimulationError if it cannot keep up.
[[nodiscard]] SimulatedDraw simulate_draw(const Candidate& candidate, const setup::CommonOptions& options,
                                          std::uint32_t d);

/// Why a candidate that keeps up cannot be recommended; none: it can. Empty for timer_beside_group(). A
/// candidate may lose up to one percent more than the current executor, or anything if that is overloaded.
[[nodiscard]] std::optional<std::string> refusal(const Prediction& prediction, const Prediction& now);

/// The first timer that a timer thread runs beside other callbacks of its mutually exclusive group; empty:
/// there is none.
[[nodiscard]] std::string timer_beside_group(const Candidate& candidate);

/// Whether a deployment file can express the candidate: it splits no callback group.
[[nodiscard]] bool can_be_written(const Candidate& candidate);

/// The best candidate that can be recommended. The current executor is preferred, if it can be
/// recommended, unless the best one is better beyond noise and in the objective as printed; a proven one
/// always. nullptr: there is none.
[[nodiscard]] const Prediction* recommended(const std::vector<Prediction>& ranked, const Prediction& now,
                                            const Objective& objective);

/// Whether two predictions differ beyond the noise between draws; none: unknown.
[[nodiscard]] std::optional<bool> differs(const Objective& objective, const Prediction& a,
                                          const Prediction& b);

/// `21.4 ms`, or another objective's value with its unit.
[[nodiscard]] std::string value_text(const Objective& objective, const Prediction& prediction);

}  // namespace hotpath::advise
