// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_observation.hpp"

#include <algorithm>
#include <map>

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

std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations) {
  const std::vector<ChainIndex> chains = index_chains(graph);

  // Jobs of the timers of source nodes in the order in which they ran, and the finish of every sink job.
  std::vector<TaskId> timer_of_node(graph.nodes.size(), kNoTask);
  std::vector<bool> is_sink(graph.nodes.size(), false);
  for (const ChainIndex& c : chains) is_sink[c.sink] = true;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.origin[id].input) timer_of_node[tasks.origin[id].node] = id;
  }
  std::vector<std::vector<const JobRecord*>> ran(tasks.set.size());
  std::map<std::pair<TaskId, std::uint64_t>, Time> sink_finish;
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran && r.outcome != Outcome::running) continue;
    ran[r.job.task].push_back(&r);
    if (r.outcome == Outcome::ran && is_sink[tasks.origin[r.job.task].node]) {
      sink_finish[{r.job.task, r.job.sequence}] = r.finish;
    }
  }
  for (auto& jobs : ran) {
    std::stable_sort(jobs.begin(), jobs.end(),
                     [](const JobRecord* a, const JobRecord* b) { return a->start < b->start; });
  }

  std::vector<ChainRecord> records;
  records.reserve(observations.size());
  for (const ChainObservation& o : observations) {
    ChainRecord& record = records.emplace_back();
    record.chain = o.chain;
    record.sequence = o.sink.sequence;
    record.dropped = o.dropped;
    record.hot_path_latency = o.sink_start - o.latest_source_start;

    const auto finish = sink_finish.find({o.sink.task, o.sink.sequence});
    Time oldest = kNever;
    bool known = finish != sink_finish.end();
    const std::vector<std::uint32_t>& sources = chains[o.chain].sources;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if ((o.sources_seen >> i & 1U) == 0) continue;
      const auto& jobs = ran[timer_of_node[sources[i]]];
      if (o.source_sequence[i] < jobs.size()) {
        oldest = std::min(oldest, jobs[o.source_sequence[i]]->job.timestamp);
      } else {
        known = false;
      }
    }
    if (known) record.end_to_end_latency = finish->second - oldest;
  }
  return records;
}

}  // namespace hotpath
