// SPDX-License-Identifier: Apache-2.0
// Priorities that are inherited, the order of events by them, and the data that messages hand on.
#include <algorithm>
#include <tuple>
#include <utility>

#include "simulation_state.hpp"

namespace independent {

/// Subscriptions inherit from the timers upstream; a priority of their own goes first under fp.
std::vector<std::int64_t> ranks_of(const Graph& graph, const std::string& policy, Fault fault) {
  const bool least = fault == Fault::least_urgent_inherited;
  std::vector<std::int64_t> ranks(graph.tasks.size(),
                                  least ? std::numeric_limits<std::int64_t>::min() : kNever);
  for (std::size_t t = 0; t < ranks.size(); ++t) {
    const Task& timer = graph.tasks[t];
    if (!timer.timer) continue;
    ranks[t] = policy == "rm" ? timer.period : policy == "dm" ? timer.deadline : timer.priority.value_or(0);
    std::vector<int> reached = successors(graph, static_cast<int>(t), true);
    for (std::size_t i = 0; i < reached.size(); ++i) {
      std::int64_t& rank = ranks[static_cast<std::size_t>(reached[i])];
      rank = least ? std::max(rank, ranks[t]) : std::min(rank, ranks[t]);
      for (const int next : successors(graph, reached[i], true)) {
        if (std::ranges::find(reached, next) == reached.end()) reached.push_back(next);
      }
    }
  }
  for (std::size_t t = 0; t < ranks.size(); ++t) {
    if (policy == "fp") ranks[t] = graph.tasks[t].priority.value_or(ranks[t]);
  }
  return ranks;
}

bool precedes(const Executor& executor, Fault fault, const Ready& a, const Ready& b) {
  const auto urgency = [&](const Ready& r) -> std::pair<bool, std::int64_t> {
    if (executor.samples_first && !r.timer) return {false, 0};
    return {executor.samples_first, executor.policy == "edf" ? r.deadline : r.rank};
  };
  if (urgency(a) != urgency(b)) return urgency(a) < urgency(b);
  if (executor.fifo) return a.activation < b.activation;
  if (a.timer != b.timer) return b.timer != (fault == Fault::timers_before_samples);
  if (a.timer) return std::tie(a.task, a.timestamp) < std::tie(b.task, b.timestamp);
  return (a.activation > b.activation) != (fault == Fault::equal_priority_fifo);
}

void merge(History& into, const History& from) {
  for (std::size_t s = 0; s < kMostSources; ++s) {
    if (from[s].jobs == 0) continue;
    const bool same = into[s].jobs == 1 && from[s].jobs == 1 && into[s].oldest == from[s].oldest;
    into[s].jobs = same ? 1 : into[s].jobs + from[s].jobs > 1 ? 2 : 1;
    into[s].oldest = std::min(into[s].oldest, from[s].oldest);
    into[s].latest_start = std::max(into[s].latest_start, from[s].latest_start);
  }
}

History handed_on(const Graph& graph, const History& history, int from, int to) {
  History result{};
  for (std::size_t s = 0; s < graph.ways.size(); ++s)
    if (graph.ways[s].contains({from, to})) result[s] = history[s];
  return result;
}

History data_of_job(const Graph& graph, const Job& job, const History& sample) {
  History own = handed_on(graph, sample, job.parent, job.task), started{};
  for (const int s : graph.tasks[static_cast<std::size_t>(job.task)].sources) {
    own[static_cast<std::size_t>(s)] = {};
    started[static_cast<std::size_t>(s)] = {job.timestamp, job.start, 1};
  }
  merge(own, started);
  return own;
}

Mark data_of(const Chain& chain, const History& history, Fault fault) {
  Mark data;
  for (const int s : chain.sources) {
    const Mark& mark = history[static_cast<std::size_t>(s)];
    const bool newest =
        fault == Fault::newest_source_timestamp && data.oldest != kNever && mark.oldest != kNever;
    data.oldest = newest ? std::max(data.oldest, mark.oldest) : std::min(data.oldest, mark.oldest);
    const bool earliest =
        fault == Fault::earliest_source_start && data.latest_start >= 0 && mark.latest_start >= 0;
    data.latest_start = earliest ? std::min(data.latest_start, mark.latest_start)
                                 : std::max(data.latest_start, mark.latest_start);
    data.jobs = std::max(data.jobs, mark.jobs);
  }
  return data;
}

}  // namespace independent
