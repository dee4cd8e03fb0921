// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Sources of one chain that an observation can hold.
inline constexpr std::size_t kMaxSources = 8;

/// What the sink of a chain found in the data that one of its jobs worked on. Fixed size: the job path stores
/// it.
struct ChainObservation {
  std::uint32_t chain = 0;
  JobRef sink;
  Time sink_start{};
  Time latest_source_start{};
  std::uint32_t dropped = 0;       ///< Sum of the dropped samples of the chain's nodes in the message.
  std::uint32_t sources_seen = 0;  ///< Bit i: source i of the chain is in the message.
  std::array<std::uint32_t, kMaxSources> source_sequence{};  ///< Publication count of each source seen.
};

/// Chains of a graph by node index.
struct ChainIndex {
  std::vector<std::uint32_t> nodes, sources;
  std::uint32_t sink = 0;
};
std::vector<ChainIndex> index_chains(const Graph& graph);

/// Chain records of a trace, whose `jobs` must be complete. A source's n-th publication is that of the n-th
/// job of its timer that ran; the end-to-end latency is unknown (-1) where that job, or the sink's own, is
/// not among the records.
std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations);

}  // namespace hotpath
