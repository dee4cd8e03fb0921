// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// The bound on a chain's data age and its components, in nanoseconds.
struct ChainAge {
  /// Finish of the sink's job minus timestamp of the oldest source job in its data.
  std::int64_t latency = 0;
  /// Part of `latency`: at most from the last timer's timestamp to the sink's finish.
  std::int64_t response = 0;
  /// The rest: time for which the oldest data waited for other inputs of joins and for cycles.
  std::int64_t waiting = 0;
  TaskId last_timer = kNoTask;
  TaskId sink = kNoTask;
  TaskId waited_at = kNoTask;  ///< Last task at which the oldest data waited; kNoTask if it never waited.
  PathParts parts;             ///< Of `response`.
  /// Bound on the start of the sink's job minus the latest start of a source job in its data.
  /// std::nullopt: not bounded.
  std::optional<std::int64_t> hot_path = {};
};

/// Bound on the age of a chain's data (docs/chain_bounds.md, "Age of data"). std::nullopt if no data of
/// a source reaches a sink or a path has no bound; `why` then states the reason.
std::optional<ChainAge> chain_age(const GraphTopology& topology, const PathBounds& paths,
                                  const CallbackGraph::DataChain& chain, std::string& why);

}  // namespace hotpath
