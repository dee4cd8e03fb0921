// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/chain_observation.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

namespace {

using Edges = std::vector<std::pair<TaskId, TaskId>>;  // sorted

constexpr std::size_t kFar = ~std::size_t{0};

/// By task: the least number of edges from one of the tasks `from`; kFar: there is no way.
std::vector<std::size_t> distances(const std::vector<std::vector<TaskId>>& next,
                                   const std::vector<TaskId>& from) {
  std::vector<std::size_t> distance(next.size(), kFar);
  std::vector<TaskId> reached = from;
  for (const TaskId id : from) distance[id] = 0;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    for (const TaskId id : next[reached[i]]) {
      if (distance[id] != kFar) continue;
      distance[id] = distance[reached[i]] + 1;
      reached.push_back(id);
    }
  }
  return distance;
}

using Next = std::vector<std::vector<TaskId>>;

/// By task: the tasks whose messages have the data of its messages: the subscriptions that take them,
/// and callbacks of their nodes that use what those store.
Next next_of(const GraphTasks& tasks) {
  Next merged(tasks.set.size()), next(tasks.set.size());
  for (TaskId id = 0; id < next.size(); ++id) {
    merged[id].push_back(id);
    const std::vector<TaskId> all = tasks.downstream(id);  // first those that it feeds itself
    merged[id].insert(merged[id].end(), all.begin() + static_cast<std::ptrdiff_t>(tasks.set[id].feeds.size()),
                      all.end());
  }
  for (TaskId id = 0; id < next.size(); ++id)
    for (const TaskId reader : tasks.set[id].feeds)
      next[id].insert(next[id].end(), merged[reader].begin(), merged[reader].end());
  return next;
}

/// The edges along which the data of the chain's sources counts.
Edges edges_of(const ChainIndex& chain, const Next& next) {
  const std::vector<std::size_t> distance = distances(next, chain.sources);
  Edges edges;
  for (TaskId from = 0; from < next.size(); ++from) {
    if (distance[from] == kFar) continue;
    for (const TaskId to : next[from]) {
      const bool feedback = distance[to] <= distance[from] && distances(next, {to})[from] != kFar;
      if (!feedback) edges.emplace_back(from, to);
    }
  }
  std::ranges::sort(edges);
  return edges;
}

}  // namespace

ChainLanes::ChainLanes(const Graph& graph, const GraphTasks& tasks)
    : ChainLanes(index_chains(graph, tasks), next_of(tasks)) {}

ChainLanes::ChainLanes(const std::vector<ChainIndex>& chains, const Next& next) : begins_(next.size()) {
  Next before(next.size());
  for (TaskId id = 0; id < next.size(); ++id)
    for (const TaskId to : next[id]) before[to].push_back(id);
  for (std::uint32_t c = 0; c < chains.size(); ++c) {
    const ChainIndex& chain = chains[c];
    Edges edges = edges_of(chain, next);
    const std::vector<std::size_t> to_sink = distances(before, chain.sink_tasks);
    for (std::size_t s = 0; s < chain.sources.size(); ++s) {
      const std::vector<std::size_t> reached = distances(next, {chain.sources[s]});
      bool other_way = false;
      for (TaskId from = 0; from < next.size() && !other_way; ++from) {
        other_way = reached[from] != kFar && std::ranges::any_of(next[from], [&](TaskId to) {
                      return to_sink[to] != kFar && !std::ranges::binary_search(edges, std::pair(from, to));
                    });
      }
      if (!other_way) continue;
      begins_[chain.sources[s]].push_back(kLane | static_cast<TaskId>(lanes_.size()));
      lanes_.push_back({c, s, chain.sources[s]});
    }
    edges_.push_back(std::move(edges));
  }
  if (lanes_.empty()) begins_.clear();
}

TaskId ChainLanes::entry(std::uint32_t chain, std::size_t source, TaskId task) const {
  const auto lane = std::ranges::find_if(
      lanes_, [&](const Lane& l) { return l.chain == chain && l.source_index == source; });
  return lane == lanes_.end() ? task : kLane | static_cast<TaskId>(lane - lanes_.begin());
}

std::span<const TaskId> ChainLanes::begins(TaskId task) const {
  return task < begins_.size() ? std::span<const TaskId>(begins_[task]) : std::span<const TaskId>();
}

bool ChainLanes::keeps(TaskId entry, TaskId from, TaskId to) const {
  const std::size_t number = entry & ~kLane;
  if (number >= lanes_.size()) return false;  // of a message that is not of this graph
  return std::ranges::binary_search(edges_[lanes_[number].chain], std::pair(from, to));
}

std::vector<TaskId> tasks_named(const Graph& graph, const GraphTasks& tasks, const std::string& name) {
  std::vector<TaskId> named;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    // No task has the name of another node.
    const bool of_node = graph.nodes[tasks.origin[id].node].name == name;
    if (of_node || tasks.set[id].name == name) named.push_back(id);
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

ChainJoin::ChainJoin(std::vector<ChainIndex> chains, TaskId tasks, std::size_t most)
    : chains_(std::move(chains)),
      most_(most),
      is_source_(tasks, false),
      is_sink_(tasks, false),
      source_jobs_(tasks),
      sink_jobs_(tasks) {
  for (const ChainIndex& c : chains_) {
    for (const TaskId id : c.sink_tasks) is_sink_[id] = true;
    for (const TaskId id : c.sources) is_source_[id] = true;
  }
}

const ChainJoin::EndJob* ChainJoin::find(const Jobs& jobs, std::uint64_t sequence) {
  if (jobs.empty()) return nullptr;
  const std::uint64_t place = sequence - jobs.front().sequence;  // if none is missing before it
  if (place < jobs.size() && jobs[place].sequence == sequence) return &jobs[place];
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
  ChainJoin chains(index_chains(graph, tasks), tasks.set.size());
  for (const JobRecord& r : trace.jobs) chains.add(r);
  std::vector<ChainRecord> records;
  records.reserve(observations.size());
  for (const ChainObservation& o : observations) records.push_back(chains.join(o));
  return records;
}

}  // namespace hotpath
