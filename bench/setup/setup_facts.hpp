// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "setup/run_setup.hpp"

namespace hotpath {

/// The keys of run.json that live and simulated runs share.
nlohmann::json common_facts(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                            const std::vector<ExecutorSpec>& executors);

/// Warnings about options that have no effect under these executors.
std::vector<std::string> idle_options(const CommonOptions& options,
                                      const std::vector<ExecutorSpec>& executors);

/// For graphs without subscriptions: the tightest bound on each task's response time under each
/// executor, if any method applies to the graph's platform: {executor, task, ms, method}. Empty for
/// other graphs.
nlohmann::json bounds_json(const Graph& graph, const GraphTasks& tasks,
                           const std::vector<ExecutorSpec>& executors);

/// The simulated machine as JSON, and back; the latter throws nlohmann's exceptions for invalid
/// input.
nlohmann::json platform_json(const GraphPlatform& platform);
GraphPlatform platform_from_json(const nlohmann::json& platform);

}  // namespace hotpath
