// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// The bound of a chain and what it consists of, nanoseconds.
struct ChainAge {
  std::int64_t latency =
      0;  ///< Finish of the sink's job minus timestamp of the oldest source job in its data.
  std::int64_t response = 0;  ///< Of it: from the last timer's timestamp to the sink's finish.
  std::int64_t waiting =
      0;  ///< The rest: what the oldest data waited for other inputs of joins and for cycles.
  TaskId last_timer = kNoTask;
  TaskId sink = kNoTask;
  TaskId waited_at = kNoTask;  ///< The last task at which the oldest data waited; none: nowhere.
  PathParts parts;             ///< Of `response`.
  /// Start of the sink's job minus the latest start of a source job in its data; none: not bounded.
  std::optional<std::int64_t> hot_path;
};

/// Largest age of a chain's data (docs/analysis.md, "Age of data"). None when the sinks never have data of a
/// source, or a path has no bound; `why` then says which task is the reason.
std::optional<ChainAge> chain_age(const GraphTopology& topology, const PathBounds& paths,
                                  const CallbackGraph::DataChain& chain, std::string& why);

}  // namespace hotpath
