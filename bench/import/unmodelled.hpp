// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// What the recording shows and a graph does not express, as sentences: synchronisers, and topics
/// that callbacks published by no rule.
[[nodiscard]] std::vector<std::string> unmodelled(const tracing::System& system, const RecordedGraph& graph);

}  // namespace hotpath::imports
