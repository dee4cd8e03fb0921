// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// End-to-end latency of data that a chain of timers, which read what the one before last wrote, hands on.
struct ChainBound {
  std::string method;
  std::optional<Duration> latency;
  std::string refusal;
};

/// The methods for `names`, timers of the graph, under `executor`. Throws AnalysisError for an unknown name.
std::vector<ChainBound> timer_chain_bounds(const GraphTasks& tasks, const ExecutorEntry& executor,
                                           Duration delta, const std::vector<std::string>& names);

}  // namespace hotpath
