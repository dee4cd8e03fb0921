// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "setup/run_setup.hpp"

namespace hotpath {

/// What run.json says of a live and of a simulated run alike.
nlohmann::json common_facts(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                            const std::vector<ExecutorSpec>& executors);

/// Sentences about options that change nothing under any of these executors.
std::vector<std::string> idle_options(const CommonOptions& options,
                                      const std::vector<ExecutorSpec>& executors);

/// For graphs of timers alone, the tightest worst-case response time of each task under each executor that a
/// method bounds on the graph's platform: {executor, task, ms, method}. Empty for other graphs.
nlohmann::json bounds_json(const Graph& graph, const GraphTasks& tasks,
                           const std::vector<ExecutorSpec>& executors);

/// The simulated machine, and back (nlohmann's exceptions for what is none).
nlohmann::json platform_json(const GraphPlatform& platform);
GraphPlatform platform_from_json(const nlohmann::json& platform);

}  // namespace hotpath
