// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Bounds on services (Task::service) that hold however much work is more urgent, beside those of other
/// paths. They wait in one queue, in the order of their publications, and the oldest runs at the latest a
/// service wait and the longest job after the one before it (docs/response_bounds.md, "Service wait").
/// `topology` and `others` must outlive the result. `wait` > 0. Does not cover delivery delays.
[[nodiscard]] std::unique_ptr<PathBounds> service_paths(const GraphTopology& topology,
                                                        const PathBounds& others,
                                                        const GraphOverheads& overheads, std::int64_t wait);

}  // namespace hotpath
