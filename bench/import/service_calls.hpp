// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "import/recorded_executors.hpp"

namespace hotpath::imports {

/// Attributes requests to the callbacks that sent them, as publications at the ends of their jobs,
/// because a trace shows neither. A callback of a node with a client of the service is the caller
/// if it ran about as often as the service, and nearly all jobs of the service follow one job each
/// of it; of several, the one whose jobs end closest before. `jobs` are in the order of starts.
/// Returns one sentence for each service with a caller.
[[nodiscard]] std::vector<std::string> attribute_requests(const tracing::System& system,
                                                          std::vector<tracing::Job>& jobs);

/// Sentences about callbacks of clients and waitables that the trace does not show.
[[nodiscard]] std::vector<std::string> unseen_callbacks(const tracing::System& system,
                                                        const std::vector<RecordedExecutor>& executors);

}  // namespace hotpath::imports
