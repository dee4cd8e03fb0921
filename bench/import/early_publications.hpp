// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath {

/// A task that publishes well before its jobs end. The simulation publishes at their ends.
struct EarlyPublication {
  TaskId task = 0;
  Duration before_end{};  ///< Median time from a job's last message to its end.
  double share = 0;       ///< Median share of a job before its last message, 0 to 1.
};

/// Tasks that publish over a tenth of the job and over 0.1 ms before its end, the earliest first.
[[nodiscard]] std::vector<EarlyPublication> early_publications(const RecordedGraph& graph,
                                                               std::span<const tracing::Job> jobs);

}  // namespace hotpath
