// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The physical lower limit of a chain's hot-path latency, from the start of a source to the start
/// of the sink, if nothing else runs. For Autoware's hot path: 4 and 5 crunches.
struct ChainLimits {
  Duration one_core_per_branch{};  ///< Work of the nodes before the sink on the longest branch.
  Duration one_thread{};           ///< Work of all nodes before the sink.
};
/// The limits of a chain of a valid graph.
ChainLimits chain_limits(const Graph& graph, const Chain& chain);

}  // namespace hotpath
