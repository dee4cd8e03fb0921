// SPDX-License-Identifier: Apache-2.0
// What the busy windows of a processor need of a deployed system.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/deployment_bounds.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"

namespace hotpath {

/// Why the busy windows of processors do not cover the system; none if they do.
[[nodiscard]] std::optional<std::string> refusal_of(const DeployedSystem& system);

/// The ranks of a processor's tasks, those in `here`. Threads of one priority take turns in any order; a
/// thread that has its priority for itself runs its jobs in the executor's order if that is a fixed one.
[[nodiscard]] GraphOrder order_on(const DeployedSystem& system, const std::vector<bool>& here);

/// What comes before each job of the tasks in `here`. Every job of a wait set may need a wait.
[[nodiscard]] GraphOverheads overheads_on(const DeployedSystem& system, const std::vector<bool>& here);

/// The graph without joins whose inputs run in several threads: each of their jobs may publish.
[[nodiscard]] CallbackGraph with_joins_of_one_thread(const DeployedSystem& system);

}  // namespace hotpath
