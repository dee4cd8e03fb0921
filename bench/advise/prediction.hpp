// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "advise/candidates.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

/// How candidates are simulated.
struct PredictionOptions {
  CommonOptions common;     ///< Phases, seed, warm-up and measured time of each draw.
  std::uint32_t draws = 1;  ///< >= 1.
  Duration budget{};        ///< No draw begins after it.
  unsigned threads = 0;     ///< 0: one for each processor. Results do not depend on it.
};

/// What the simulations of one candidate showed.
struct Prediction {
  const Candidate* candidate = nullptr;
  std::vector<Repetition> draws;   ///< Without jobs.
  ExecutorSummary summary;         ///< Of all draws, with intervals over them.
  double cores_used = 0;           ///< Work of the jobs that ran, on average.
  std::string overload;            ///< Why there is no summary; empty: there is one.
  std::optional<double> bound_ms;  ///< End to end, of the objective's chain, for any phases.
  std::string bound_method;
};

/// Simulates all candidates that can keep up over draws of phases and execution times; draw i has the same
/// phases and times under each. Stops after the draw in which the budget ends, or when interrupted: all have
/// the same draws then, at least one. `progress` is told of the draws that are done.
[[nodiscard]] std::vector<Prediction> predict(const std::vector<Candidate>& candidates,
                                              const PredictionOptions& options,
                                              const std::function<void(std::uint32_t)>& progress);

/// The tightest bound of the chain that theory gives for any phases, where it gives one.
void add_bound(Prediction& prediction, const std::string& chain);

/// The chain's latencies in ms by draw.
[[nodiscard]] RepeatedSamples latencies_of(const Prediction& prediction, std::size_t chain);

}  // namespace hotpath
