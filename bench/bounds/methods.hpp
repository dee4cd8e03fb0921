// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/analysis/release_overhead.hpp"
#include "hotpath/core/registry.hpp"

namespace hotpath {

/// What theory knows of an executor.

/// How it releases timers, as the analyses distinguish it.
ReleaseMode release_mode(const ExecutorEntry& executor);

/// The policy by which it is analysed. None for wait sets, nor for the stock release-and-execute executor,
/// which orders timers by their next calls: no method here analyses that.
std::optional<Policy> analysed_policy(const ExecutorEntry& executor);

/// What Teper 2024 analyses: one worker that polls, timers before subscriptions.
bool is_default_executor(const ExecutorEntry& executor);

struct NamedAnalysis {
  const char* method;  ///< Author and year.
  ResponseTimeAnalysis analysis;
};

/// The analyses of independent periodic tasks under a policy.
std::vector<NamedAnalysis> analyses(Policy policy);

}  // namespace hotpath
