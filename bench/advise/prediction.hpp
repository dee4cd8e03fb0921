// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "advise/candidates.hpp"
#include "advise/objective.hpp"
#include "hotpath/core/workload.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::advise {

/// How candidates are simulated.
struct PredictionOptions {
  setup::CommonOptions common;  ///< Phases, seed, warm-up and measured time of each draw.
  std::uint32_t draws = 1;      ///< >= 1.
  Duration budget{};            ///< No draw begins after it.
  unsigned threads = 0;         ///< 0: one for each processor. Results do not depend on it.
};

/// The result of one candidate's simulations.
struct Prediction {
  const Candidate* candidate = nullptr;
  std::vector<results::Repetition> draws;  ///< Without jobs.
  results::ExecutorSummary summary;        ///< Of all draws, with intervals over them.
  double cores_used = 0;                   ///< Mean work of the jobs that ran.
  std::string overload;                    ///< Why there is no summary; empty: there is one.
  /// Bound of the objective's chain for any phases: of the hot-path latency if the objective is that
  /// latency, else of the end-to-end latency.
  std::optional<double> bound_ms;
  std::string bound_method;
};

/// Simulates all candidates that can keep up, over draws of phases and execution times; draw i has
/// the same phases and times for every candidate. Stops after the draw in which the budget ends, or
/// on interruption, so that all candidates have the same draws, at least one. `progress` gets the
/// number of finished draws.
[[nodiscard]] std::vector<Prediction> predict(const std::vector<Candidate>& candidates,
                                              const PredictionOptions& options,
                                              const std::function<void(std::uint32_t)>& progress);

/// One simulation of a candidate, with its jobs.
struct SimulatedDraw {
  GraphTasks tasks;  ///< With the phases of the draw.
  std::unique_ptr<ExecutionTimes> times;
  results::Repetition repetition;
};
/// Draw `d` of a candidate. Throws SimulationError if it cannot keep up.
[[nodiscard]] SimulatedDraw simulate_draw(const Candidate& candidate, const setup::CommonOptions& options,
                                          std::uint32_t d);

/// Adds the tightest bound of the objective's chain, if a method covers the candidate.
void add_bound(Prediction& prediction, const Objective& objective);

/// The latencies of the objective's chain in ms by draw: hot-path, or else end-to-end.
[[nodiscard]] RepeatedSamples latencies_of(const Prediction& prediction, const Objective& objective);

}  // namespace hotpath::advise
