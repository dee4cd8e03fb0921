// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "import/recorded_executors.hpp"

namespace hotpath {

/// The observations of the chains' sinks. Histories of jobs follow the recorded messages, and the
/// inferred rules within nodes. `graph.graph` has the chains.
[[nodiscard]] std::vector<ChainObservation> recorded_chains(const tracing::System& system,
                                                            const RecordedGraph& graph,
                                                            const RecordedWindow& window);

}  // namespace hotpath
