// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "hotpath/reference_system/graph.hpp"
#include "properties.hpp"

namespace hotpath::test {

/// Simulates a graph under an executor with random phases and execution times, and passes the events of
/// the run to the watcher with the contract of the graph. `planted`: one job takes longer than its
/// budget. Wrong: an alarm without a fault, a planted fault that is not named, or a chain whose latencies
/// differ from those of the simulation.
CaseResult check_watched(const Graph& graph, const std::string& executor, std::uint64_t seed, bool planted);

/// The same for a random graph. No executor: a random deployment of it, whose threads the watcher sees as
/// well.
CaseResult check_watched(const std::string& executor, std::uint64_t seed, bool planted);

}  // namespace hotpath::test
