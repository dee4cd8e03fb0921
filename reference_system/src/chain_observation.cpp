// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_observation.hpp"

#include <algorithm>

namespace hotpath {

std::vector<TaskId> tasks_named(const Graph& graph, const GraphTasks& tasks, const std::string& name) {
  std::vector<TaskId> named;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (graph.nodes[tasks.origin[id].node].name == name) named.push_back(id);
  }
  for (TaskId id = 0; named.empty() && id < tasks.set.size(); ++id) {
    if (tasks.set[id].name == name) named.push_back(id);
  }
  return named;
}

std::vector<ChainIndex> index_chains(const Graph& graph, const GraphTasks& tasks) {
  std::vector<ChainIndex> chains;
  for (const Chain& chain : graph.chains) {
    ChainIndex& c = chains.emplace_back();
    for (const std::string& node : chain.nodes) c.nodes.push_back(tasks_named(graph, tasks, node));
    for (const std::string& node : chain.sources) {
      const std::vector<TaskId> named = tasks_named(graph, tasks, node);
      const auto timer =
          std::ranges::find_if(named, [&](TaskId id) { return tasks.set[id].kind == TaskKind::timer; });
      c.sources.push_back(timer == named.end() ? named.front() : *timer);
    }
    c.sink_tasks = tasks_named(graph, tasks, chain.sink);
    c.sink = tasks.origin[c.sink_tasks.front()].node;
    std::erase_if(c.sink_tasks, [&](TaskId id) { return tasks.callbacks[id].stores_only; });
  }
  return chains;
}

ChainJoin::ChainJoin(const Graph& graph, const GraphTasks& tasks)
    : chains_(index_chains(graph, tasks)),
      is_source_(tasks.set.size(), false),
      is_sink_(tasks.set.size(), false),
      source_jobs_(tasks.set.size()),
      sink_jobs_(tasks.set.size()) {
  for (const ChainIndex& c : chains_) {
    for (const TaskId id : c.sink_tasks) is_sink_[id] = true;
    for (const TaskId id : c.sources) is_source_[id] = true;
  }
}

const ChainJoin::EndJob* ChainJoin::find(const Jobs& jobs, std::uint64_t sequence) {
  const auto job = std::ranges::lower_bound(jobs, sequence, {}, &EndJob::sequence);
  return job == jobs.end() || job->sequence != sequence ? nullptr : &*job;
}

ChainRecord ChainJoin::join(const ChainObservation& o) const {
  ChainRecord record;
  record.chain = o.chain;
  record.sequence = o.sink.sequence;
  record.sink = o.sink.task;
  record.dropped = o.dropped;
  record.hot_path_latency = o.sink_start - o.latest_source_start;

  const EndJob* const sink = find(sink_jobs_[o.sink.task], o.sink.sequence);
  if (sink == nullptr) return record;
  record.finish = sink->finish;
  Time oldest = kNever, newest{};
  const std::vector<TaskId>& sources = chains_[o.chain].sources;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if ((o.sources_seen >> i & 1U) == 0) continue;
    const Jobs& jobs = source_jobs_[sources[i]];
    const std::uint64_t sequence = o.source_sequence[i];
    const EndJob* const source = o.names_jobs             ? find(jobs, sequence)
                                 : sequence < jobs.size() ? &jobs[sequence]
                                                          : nullptr;
    if (source == nullptr) return record;
    oldest = std::min(oldest, source->timestamp);
    newest = std::max(newest, source->timestamp);
  }
  record.end_to_end_latency = record.finish - oldest;
  record.disparity = newest - oldest;
  return record;
}

std::optional<Time> ChainJoin::sink_timestamp(JobRef job) const {
  const EndJob* const sink = find(sink_jobs_[job.task], job.sequence);
  return sink == nullptr ? std::nullopt : std::optional(sink->timestamp);
}

std::vector<ChainRecord> join_chains(const Graph& graph, const GraphTasks& tasks, const Trace& trace,
                                     const std::vector<ChainObservation>& observations) {
  std::vector<const JobRecord*> jobs;
  for (const JobRecord& r : trace.jobs) jobs.push_back(&r);
  std::ranges::stable_sort(jobs, {}, &JobRecord::start);
  ChainJoin chains(graph, tasks);
  for (const JobRecord* r : jobs) chains.add(*r);
  std::vector<ChainRecord> records;
  records.reserve(observations.size());
  for (const ChainObservation& o : observations) records.push_back(chains.join(o));
  return records;
}

}  // namespace hotpath
