// SPDX-License-Identifier: Apache-2.0
#include "results/measures.hpp"

#include <algorithm>
#include <unordered_map>

namespace hotpath {

std::vector<ChainRecord> counted_chains(const Trace& trace, const std::vector<MeasuredChain>& chains,
                                        Time counted_from) {
  std::vector<std::unordered_map<std::uint64_t, Time>> sink_timestamps(chains.size());
  for (std::size_t c = 0; c < chains.size(); ++c) {
    const auto& sinks = chains[c].sink_tasks;
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome != Outcome::ran || std::find(sinks.begin(), sinks.end(), r.job.task) == sinks.end()) {
        continue;
      }
      const auto [found, added] = sink_timestamps[c].emplace(r.job.sequence, r.job.timestamp);
      if (!added) found->second = std::min(found->second, r.job.timestamp);
    }
  }
  std::vector<ChainRecord> counted;
  for (const ChainRecord& r : trace.chains) {
    const auto sink = sink_timestamps[r.chain].find(r.sequence);
    const bool early = sink != sink_timestamps[r.chain].end() && sink->second < counted_from;
    if (!early) counted.push_back(r);
  }
  return counted;
}

}  // namespace hotpath
