// SPDX-License-Identifier: Apache-2.0
#include "bounds/bounds.hpp"

#include <algorithm>
#include <functional>

#include "bounds/graph_chains.hpp"
#include "bounds/methods.hpp"
#include "hotpath/analysis/buttazzo_2013.hpp"
#include "hotpath/analysis/teper_2024.hpp"

namespace hotpath {

namespace {

std::optional<Duration> duration(const std::optional<std::int64_t>& ns) {
  return ns ? std::optional(Duration(*ns)) : std::nullopt;
}

/// Fills in what a method finds, or why it refuses.
BoundSet attempt(const ExecutorEntry& executor, const char* method,
                 const std::function<void(BoundSet&)>& analyse) {
  BoundSet set{std::string(executor.name), method, {}, {}, {}};
  try {
    analyse(set);
  } catch (const AnalysisError& error) {
    set.tasks.clear();
    set.chains.clear();
    set.refusal = error.what();
  }
  return set;
}

void bound_periodic(const GraphTasks& tasks, const ExecutorEntry& executor, Policy policy, Duration delta,
                    const ResponseTimeAnalysis& analysis, BoundSet& out) {
  const PeriodicTasks periodic = periodic_tasks(tasks.set, policy);
  const OverheadAwareResponse response =
      with_release_overhead(periodic, delta.count(), release_mode(executor), analysis);
  out.tasks.resize(tasks.set.size());
  for (std::size_t i = 0; i < periodic.size(); ++i) out.tasks[periodic[i].id] = duration(response.bounds[i]);
}

void bound_sequences(const Graph& graph, const GraphTasks& tasks, Policy policy, BoundSet& out) {
  const SequenceTasks sequences = sequence_tasks(tasks.set, policy);
  const ResponseTimes response = buttazzo_2013(sequences);
  for (const Chain& chain : graph.chains) {
    const std::optional<TaskId> source = source_of_sequence(graph, tasks, chain);
    auto& bound = out.chains.emplace_back();
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      if (source == sequences[i].id) bound = duration(response[i]);
    }
  }
}

void bound_default(const Graph& graph, const GraphTasks& tasks, BoundSet& out) {
  const ExecutorCallbacks callbacks = executor_callbacks(tasks.set);
  const std::vector<std::int64_t> response = teper_2024_response_times(callbacks);
  out.tasks.resize(tasks.set.size());
  std::vector<std::size_t> position(tasks.set.size());
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    out.tasks[callbacks[i].id] = Duration(response[i]);
    position[callbacks[i].id] = i;
  }
  for (const Chain& chain : graph.chains) {
    auto& bound = out.chains.emplace_back();
    for (const std::vector<TaskId>& path : task_paths(graph, tasks, chain)) {
      TaskChain positions;
      for (const TaskId id : path) positions.push_back(position[id]);
      const Duration latency(teper_2024(callbacks, positions));
      bound = std::max(bound.value_or(Duration::zero()), latency);
    }
  }
}

}  // namespace

std::vector<BoundSet> bounds_of(const Graph& graph, const GraphTasks& tasks, const ExecutorEntry& executor,
                                Duration delta) {
  std::vector<BoundSet> sets;
  if (is_default_executor(executor)) {
    sets.push_back(attempt(executor, "Teper 2024", [&](BoundSet& s) { bound_default(graph, tasks, s); }));
    return sets;
  }
  const std::optional<Policy> policy = analysed_policy(executor);
  if (!policy) {
    sets.push_back({std::string(executor.name), "none", {}, {}, "no published bound covers this executor"});
    return sets;
  }
  const bool timers_only = std::all_of(tasks.set.tasks.begin(), tasks.set.tasks.end(),
                                       [](const Task& t) { return t.kind == TaskKind::timer; });
  const bool fixed = policy == Policy::rm || policy == Policy::dm || policy == Policy::fp;
  if (!timers_only && fixed && release_mode(executor) == ReleaseMode::release_only) {
    sets.push_back(attempt(executor, "Buttazzo 2013 (sequences)",
                           [&](BoundSet& s) { bound_sequences(graph, tasks, *policy, s); }));
    return sets;
  }
  for (const NamedAnalysis& a : analyses(*policy)) {
    sets.push_back(attempt(executor, a.method, [&](BoundSet& s) {
      bound_periodic(tasks, executor, *policy, delta, a.analysis, s);
    }));
  }
  return sets;
}

}  // namespace hotpath
