// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "results/run_folder.hpp"
#include "results/run_record.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::setup {

/// What live, simulated and imported runs record alike. The caller adds `kind`, `simulation` or
/// `live`, and `bounds`.
[[nodiscard]] results::RunRecord record_of(const CommonOptions& options, const Graph& graph,
                                           const TaskSet& set, const std::vector<ExecutorSpec>& executors);

/// Stores copies of the graph, which was loaded from the file of the options, of the deployments and of the
/// file `times` (empty: none) in the run's folder, and notes them in `record`. Throws RunError, InputError.
void keep_inputs(const results::RunFolder& folder, const CommonOptions& options, const Graph& graph,
                 results::RunRecord& record, const std::string& times = "");

/// Warnings about options that have no effect under these executors.
std::vector<std::string> idle_options(const CommonOptions& options,
                                      const std::vector<ExecutorSpec>& executors);

/// For graphs without subscriptions: the tightest bound on each task's response time under each
/// executor, if any method applies to the graph's platform. Empty for other graphs.
std::vector<results::BoundRecord> timer_bounds(const Graph& graph, const GraphTasks& tasks,
                                               const std::vector<ExecutorSpec>& executors);

}  // namespace hotpath::setup
