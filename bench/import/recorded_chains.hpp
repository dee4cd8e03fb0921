// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "import/recorded_executors.hpp"

namespace hotpath {

/// What the sinks of the graph's chains had in their data: histories of jobs follow the recorded messages,
/// and within nodes the inferred rules. `graph.graph` has the chains.
[[nodiscard]] std::vector<ChainObservation> recorded_chains(const RecordedSystem& system,
                                                            const RecordedGraph& graph,
                                                            const RecordedWindow& window);

}  // namespace hotpath
