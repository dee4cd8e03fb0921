// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"

namespace hotpath {

/// The tasks that run on a processor, and their order there.
struct StreamedProcessor {
  std::vector<bool> here;  ///< By task.
  GraphOrder order;
  GraphOverheads overheads;  ///< GraphOverheads::delivery does not count.
};

/// Tasks whose samples may come late: from other processors, from threads that wake the reader's thread, or
/// all of them.
struct StreamedSystem {
  static constexpr std::uint32_t kNowhere = ~0U;

  CallbackGraph graph;                      ///< The inputs of each join run in one thread.
  std::vector<std::uint32_t> thread_of;     ///< By task.
  std::vector<std::uint32_t> processor_of;  ///< By task; kNowhere: several, in the ordinary scheduling class.
  std::vector<bool> bounded;                ///< By task: not of that class.
  std::map<std::uint32_t, StreamedProcessor> processors;
  /// Until a thread that sleeps continues, other than GraphOverheads::wake_up of its processor.
  std::int64_t wake_up = 0;
  std::int64_t delivery = 0;  ///< Longest time from a publication to its arrival; each sample has its own.
};

/// Bounds along paths whose samples may come late (docs/response_bounds.md, "Delivery"). Each hop is a busy
/// window of its own. The latest ends of the jobs that publish such samples are the least fixed point of all
/// windows. `others`, other bounds for the same system, must outlive the result; nullptr: there are none.
/// Throws AnalysisError if there is no fixed point and there are no others.
[[nodiscard]] std::unique_ptr<PathBounds> stream_paths(StreamedSystem system,
                                                       const PathBounds* others = nullptr);

}  // namespace hotpath
