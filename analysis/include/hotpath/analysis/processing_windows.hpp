// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Processing windows of rclcpp's default executor (wait set, one thread): all callbacks that a
/// poll finds ready run before the next poll, each at most once, timers before subscriptions.
/// Follows Teper 2024 (lemmas VI.1 to VI.5) and adds the response time of the head timer, joins
/// that work at most once per window, and the platform's costs (docs/response_bounds.md, "Processing
/// windows").
/// `entity_order`: all tasks in the order in which tasks of one kind are scanned; empty: order of
/// creation. The topology must outlive the result.
[[nodiscard]] std::unique_ptr<PathBounds> processing_windows(const GraphTopology& topology,
                                                             const std::vector<TaskId>& entity_order,
                                                             const GraphOverheads& overheads);

}  // namespace hotpath
