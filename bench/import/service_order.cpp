// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <numeric>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

Precedence recorded_precedence(const RecordedGraph& graph, const RecordedWindow& window, bool wait_sets) {
  const TaskId count = graph.tasks.set.size();
  Precedence precedence{{count, std::vector<std::uint32_t>(count, 0)}, 0};
  std::uint64_t pairs = 0, contradicting = 0;
  const auto in_order = [&](std::vector<TaskId>& together, TaskId task) {
    for (const TaskId other : together) {
      if (other == task || graph.tasks.set[task].kind != graph.tasks.set[other].kind) continue;
      ++precedence.before[other][task];
      ++pairs;
      contradicting += other > task;
    }
    together.push_back(task);
  };
  std::map<std::uint32_t, Time> started;  // by node: its latest job
  const bool snapshots_known = wait_sets && std::ranges::any_of(window.jobs, &tracing::Job::waited);
  std::map<std::uint32_t, std::vector<TaskId>> snapshots;                   // by thread
  std::map<std::pair<TaskId, std::uint64_t>, std::vector<TaskId>> readers;  // by publishing job
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const Job& job = window.records[i].job;
    if (snapshots_known) {
      std::vector<TaskId>& snapshot = snapshots[window.jobs[i].thread];
      if (window.jobs[i].waited) snapshot.clear();
      if (job.task != kNoTask) in_order(snapshot, job.task);
    } else if (job.task != kNoTask && job.parent.task != kNoTask) {
      // A node with another job since then was already queued.
      const auto last = started.find(graph.tasks.origin[job.task].node);
      if (last == started.end() || last->second < job.timestamp)
        in_order(readers[{job.parent.task, job.parent.sequence}], job.task);
    }
    if (job.task != kNoTask) started[graph.tasks.origin[job.task].node] = window.jobs[i].start;
  }
  if (pairs > 0) precedence.contradicting = static_cast<double>(contradicting) / static_cast<double>(pairs);
  return precedence;
}

namespace {

/// Repeatedly takes the item that the remaining items precede least; of equals the first one.
/// `ahead(a, b)`: how much more often a precedes b than b precedes a.
template <class Ahead>
std::vector<std::uint32_t> in_order(std::vector<std::uint32_t> left, Ahead&& ahead) {
  std::vector<std::uint32_t> order;
  while (!left.empty()) {
    const auto behind = [&](std::uint32_t item) {
      std::int64_t sum = 0;
      for (const std::uint32_t other : left)
        if (other != item) sum += std::max<std::int64_t>(0, ahead(other, item));
      return sum;
    };
    const auto first = std::ranges::min_element(left, {}, behind);
    order.push_back(*first);
    left.erase(first);
  }
  return order;
}

}  // namespace

ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                           const Precedence& precedence) {
  const std::size_t nodes = system.nodes.size();
  std::vector<std::vector<std::int64_t>> of_nodes(nodes, std::vector<std::int64_t>(nodes, 0));
  const auto task = [&](std::uint32_t c) { return graph.task_of[c]; };
  const auto ahead = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
    return std::int64_t{precedence.before[task(a)][task(b)]} -
           std::int64_t{precedence.before[task(b)][task(a)]};
  };
  std::vector<std::uint32_t> callbacks, all_nodes(nodes);
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c)
    if (task(c) != kNoTask) callbacks.push_back(c);
  std::iota(all_nodes.begin(), all_nodes.end(), 0U);
  for (const std::uint32_t a : callbacks)
    for (const std::uint32_t b : callbacks)
      of_nodes[system.callbacks[a].node][system.callbacks[b].node] += ahead(a, b);
  return {in_order(all_nodes, [&](std::uint32_t a, std::uint32_t b) { return of_nodes[a][b]; }),
          in_order(callbacks, [&](std::uint32_t a, std::uint32_t b) {
            return system.callbacks[a].node == system.callbacks[b].node ? ahead(a, b) : 0;
          })};
}

}  // namespace hotpath::imports
