// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// Reads a chain's latency out of `message`, which the sink's job `sink`, started at `start`, worked on or
/// produced. False when the message contains none of the chain's sources.
template <class History>
bool observe_chain(const History& history, const typename History::Message& message, const ChainIndex& chain,
                   JobRef sink, Time start, ChainObservation& out) {
  out.sink = sink;
  out.sink_start = start;
  for (std::size_t i = 0; i < chain.sources.size(); ++i) {
    history.find(message, chain.sources[i], [&](const Stat& stat) {
      out.latest_source_start =
          out.sources_seen == 0 ? stat.start : std::max(out.latest_source_start, stat.start);
      out.sources_seen |= 1U << i;
      out.source_sequence[i] = stat.sequence;
    });
  }
  if (out.sources_seen == 0) return false;
  for (const std::uint32_t node : chain.nodes) {
    history.find(message, node, [&](const Stat& stat) { out.dropped += stat.dropped; });
  }
  return true;
}

}  // namespace hotpath
