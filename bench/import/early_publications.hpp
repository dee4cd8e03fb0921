// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath {

/// A task that publishes well before its jobs end. The simulation publishes at their ends.
struct EarlyPublication {
  TaskId task = 0;
  Duration before_end{};  ///< Median over its jobs that published, of the last message of each.
  double share = 0;       ///< Of a job that is done by then, 0 to 1: median.
};

/// Those that have more than a tenth of the job and 0.1 ms to go, the longest time first.
[[nodiscard]] std::vector<EarlyPublication> early_publications(const RecordedGraph& graph,
                                                               std::span<const RecordedJob> jobs);

}  // namespace hotpath
