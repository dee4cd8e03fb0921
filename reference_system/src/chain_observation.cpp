// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_observation.hpp"

#include <algorithm>

namespace hotpath {

std::vector<ChainIndex> index_chains(const Graph& graph) {
  const auto index = [&](const std::string& name) {
    return static_cast<std::uint32_t>(graph.find(name) - graph.nodes.data());
  };
  std::vector<ChainIndex> chains;
  for (const Chain& chain : graph.chains) {
    ChainIndex& c = chains.emplace_back();
    for (const std::string& node : chain.nodes) c.nodes.push_back(index(node));
    for (const std::string& node : chain.sources) c.sources.push_back(index(node));
    c.sink = index(chain.sink);
  }
  return chains;
}

ChainJoin::ChainJoin(const Graph& graph, const GraphTasks& tasks)
    : chains_(index_chains(graph)),
      timer_of_node_(graph.nodes.size(), kNoTask),
      is_source_(tasks.set.size(), false),
      is_sink_(tasks.set.size(), false),
      source_timestamps_(tasks.set.size()) {
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin origin = tasks.origin[id];
    if (!origin.input) timer_of_node_[origin.node] = id;
    for (const ChainIndex& c : chains_) {
      is_sink_[id] = is_sink_[id] || c.sink == origin.node;
      const bool source = std::find(c.sources.begin(), c.sources.end(), origin.node) != c.sources.end();
      is_source_[id] = is_source_[id] || (source && !origin.input);
    }
  }
}

void ChainJoin::add(const JobRecord& r) {
  if (r.outcome != Outcome::ran && r.outcome != Outcome::running) return;
  if (is_source_[r.job.task]) source_timestamps_[r.job.task].push_back(r.job.timestamp);
  if (is_sink_[r.job.task] && r.outcome == Outcome::ran) {
    sink_jobs_[{r.job.task, r.job.sequence}] = {r.job.timestamp, r.finish};
  }
}

ChainRecord ChainJoin::join(const ChainObservation& o) const {
  ChainRecord record;
  record.chain = o.chain;
  record.sequence = o.sink.sequence;
  record.dropped = o.dropped;
  record.hot_path_latency = o.sink_start - o.latest_source_start;

  const auto sink = sink_jobs_.find({o.sink.task, o.sink.sequence});
  if (sink == sink_jobs_.end()) return record;
  Time oldest = kNever;
  const std::vector<std::uint32_t>& sources = chains_[o.chain].sources;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if ((o.sources_seen >> i & 1U) == 0) continue;
    const std::vector<Time>& timestamps = source_timestamps_[timer_of_node_[sources[i]]];
    if (o.source_sequence[i] >= timestamps.size()) return record;
    oldest = std::min(oldest, timestamps[o.source_sequence[i]]);
  }
  record.end_to_end_latency = sink->second.finish - oldest;
  return record;
}

std::optional<Time> ChainJoin::sink_timestamp(JobRef job) const {
  const auto found = sink_jobs_.find({job.task, job.sequence});
  return found == sink_jobs_.end() ? std::nullopt : std::optional(found->second.timestamp);
}

std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations) {
  std::vector<const JobRecord*> jobs;
  for (const JobRecord& r : trace.jobs) jobs.push_back(&r);
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const JobRecord* a, const JobRecord* b) { return a->start < b->start; });
  ChainJoin chains(graph, tasks);
  for (const JobRecord* r : jobs) chains.add(*r);
  std::vector<ChainRecord> records;
  records.reserve(observations.size());
  for (const ChainObservation& o : observations) records.push_back(chains.join(o));
  return records;
}

}  // namespace hotpath
