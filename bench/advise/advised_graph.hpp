// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "advise/advice.hpp"
#include "advise/candidates.hpp"
#include "advise/objective.hpp"

namespace hotpath::advise {

/// The graph of the options. A graph without chains gets those that are found, which are printed.
/// Throws UsageError and InputError.
[[nodiscard]] Graph advised_graph(const Options& options);

/// The objective of the options; by default `usual`, or worst_lateness for a graph without chains.
/// Throws UsageError.
[[nodiscard]] Objective advised_objective(const Options& options, const Graph& graph,
                                          const std::string& usual);

/// `usual`: the costs if the options name none. Throws UsageError.
[[nodiscard]] CandidateOptions candidate_options(const Options& options, const Graph& graph,
                                                 const std::string& usual);

/// Throws RunError with the number of cores that would suffice.
void check_load(const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath::advise
