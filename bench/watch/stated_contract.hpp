// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guarantees/analyze.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

/// The contract of a graph under an executor or deployment: budgets, periods, depths, publications and
/// threads, and the bounds and distances that follow from them for any phases.
[[nodiscard]] Contract stated_contract(const Graph& graph, const GraphTasks& tasks,
                                       const setup::ExecutorSpec& executor);

/// The same for the only executor or deployment of `options`. Throws UsageError and InputError.
[[nodiscard]] Contract stated_contract(const guarantees::AnalyzeOptions& options);

/// That of the run `--trace`, with its executor: limits are the worst recorded values, and this margin.
[[nodiscard]] Contract recorded_contract(const guarantees::AnalyzeOptions& options, double margin_percent);

}  // namespace hotpath::watch
