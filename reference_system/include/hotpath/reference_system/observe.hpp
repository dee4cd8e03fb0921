// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// Whether the sink's job published the message.
template <class History>
bool is_own(const History& history, const typename History::Message& message, const ChainObservation& out) {
  bool own = false;
  history.find(message, std::span(&out.sink.task, 1),
               [&](const Stat& stat) { own = stat.start == out.sink_start; });
  return own;
}

/// Extracts a chain's latency from `message`, which the sink's job `out.sink`, started at
/// `out.sink_start`, processed or produced. False if the message contains none of the chain's
/// sources.
template <class History>
bool observe_chain(const History& history, const typename History::Message& message, const ChainIndex& chain,
                   ChainObservation& out) {
  out.names_jobs = History::kNamesJobs;
  for (std::size_t i = 0; i < chain.sources.size(); ++i) {
    const TaskId entry = history.entry(out.chain, i, chain.sources[i]);
    // The message may be the job's own, or another one that it took.
    if (!history.goes_on(message, entry, out.sink.task) && !is_own(history, message, out)) continue;
    history.find(message, std::span(&entry, 1), [&](const Stat& stat) {
      out.latest_source_start =
          out.sources_seen == 0 ? stat.start : std::max(out.latest_source_start, stat.start);
      out.sources_seen |= 1U << i;
      out.source_sequence[i] = stat.sequence;
    });
  }
  if (out.sources_seen == 0) return false;
  for (const std::vector<TaskId>& node : chain.nodes) {
    history.find(message, node, [&](const Stat& stat) { out.dropped += stat.dropped; });
  }
  return true;
}

/// Passes to `append` the observations of a job in `message` for the chains `ends` that the job
/// ends, each chain at most once per job. `job` is its Activation.
template <class History, class Job, class Append>
void observe_chains(const History& history, const typename History::Message& message,
                    const std::vector<ChainIndex>& chains, std::span<const std::uint32_t> ends, Job& job,
                    Append&& append) {
  for (const std::uint32_t chain : ends) {
    if (std::find(job.observed.begin(), job.observed.end(), chain) != job.observed.end()) continue;
    ChainObservation observation;
    observation.chain = chain;
    observation.sink = job.ref;
    observation.sink_start = job.start;
    if (!observe_chain(history, message, chains[chain], observation)) continue;
    job.observed.push_back(chain);
    append(observation);
  }
}

}  // namespace hotpath
