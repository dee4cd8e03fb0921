// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "advise/advice.hpp"
#include "advise/phase_evaluator.hpp"
#include "advise/phase_search.hpp"
#include "advise/prediction.hpp"

namespace hotpath::advise {

/// What one candidate guarantees under the phases that are compared, and under those that were found.
struct PhaseCandidate {
  const Candidate* candidate = nullptr;
  std::string refusal;  ///< Why nothing is guaranteed; empty: something is.
  /// By rule (`creation`, `synchronous`, and `given` if the graph gives them).
  std::vector<std::pair<Phases, PhaseValues>> by_rule;
  std::vector<PhaseValues> random;  ///< Of random draws, the best first, without refused ones.
  bool searched = false;            ///< The members below are valid.
  FoundPhases found;                ///< The score is the worst within the margin.
  PhaseValues chosen;               ///< Under `found`.
};

/// The chosen phases with every offset off by up to `within`: exact values of some draws.
struct PhaseSensitivity {
  Duration within{};
  std::vector<PhaseValues> draws;  ///< The best first.
};

/// The result of `hotpath advise --phases`.
struct PhaseAdvice {
  const Graph& graph;
  const Objective& objective;
  std::vector<PhaseCandidate>
      candidates;                       ///< The best chosen phases first, then unsearched, then refused ones.
  const PhaseCandidate* now = nullptr;  ///< The system's current executor.
  const PhaseCandidate* best = nullptr;  ///< nullptr: nothing is guaranteed.
  Duration margin{};                     ///< Offsets off by so much were part of the search.
  Prediction simulated;                  ///< Of `best` under its chosen phases.
  std::vector<PhaseSensitivity> sensitivity;
  std::vector<std::string> files;  ///< Of the phases, and of the graph if it has other priorities.
};

void write_phase_advice(std::ostream& out, const PhaseAdvice& advice);
/// The recommendation and its gain, what proves it, how it depends on exact offsets, who pays.
[[nodiscard]] std::vector<std::string> phase_sentences(const PhaseAdvice& advice);
/// The content of phases.json.
[[nodiscard]] nlohmann::json phase_advice_json(const PhaseAdvice& advice);

/// Searches phases of timers that minimise a guaranteed latency, under each executor that the exact worst
/// cases cover; proves, simulates and perturbs the best, and writes it as a file for --phases-file. Throws
/// UsageError, InputError, and RunError if nothing is covered or a simulation exceeds a guarantee.
void advise_phases(const Options& options);

}  // namespace hotpath::advise
