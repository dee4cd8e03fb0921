// SPDX-License-Identifier: Apache-2.0
#include "bounds/bounds.hpp"

#include <algorithm>
#include <functional>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/buttazzo_2013.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/release_overhead.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/analysis/teper_2024.hpp"

namespace hotpath {

namespace {

/// How it releases timers, as the analyses distinguish it.
ReleaseMode release_mode(const ExecutorEntry& executor) {
  return executor.traits.timers == TimerHandling::release_and_execute ? ReleaseMode::release_and_execute
                                                                      : ReleaseMode::release_only;
}

/// The policy by which it is analysed. None for wait sets, nor for the stock release-and-execute executor,
/// which orders timers by their next calls: no method here analyses that.
std::optional<Policy> analysed_policy(const ExecutorEntry& executor) {
  const ExecutorTraits& t = executor.traits;
  const bool stock_re = t.family == Family::events && t.timers == TimerHandling::release_and_execute;
  return stock_re ? std::nullopt : t.policy;
}

/// What Teper 2024 analyses: one worker that polls, timers before subscriptions.
bool is_default_executor(const ExecutorEntry& executor) {
  const ExecutorTraits& t = executor.traits;
  return t.family == Family::wait_set && t.runs_first == TaskKind::timer && !t.many_workers;
}

struct NamedAnalysis {
  const char* method;  ///< Author and year.
  ResponseTimeAnalysis analysis;
};

/// The analyses of independent periodic tasks under a policy.
std::vector<NamedAnalysis> analyses(Policy policy) {
  switch (policy) {
    case Policy::rm:
    case Policy::dm:
    case Policy::fp:
      return {{"Brueggen 2015 (Theorem 1)", brueggen_2015},
              {"Davis 2007 (exact)", [](const PeriodicTasks& t) { return davis_2007(t); }}};
    case Policy::edf:
      return {{"Spuri 1996", [](const PeriodicTasks& t) { return spuri_1996(t); }}};
    case Policy::fifo:
      return {{"Bedarkar 2022",
               [](const PeriodicTasks& t) { return ResponseTimes(t.size(), bedarkar_2022(t)); }}};
  }
  return {};
}

/// All paths along task edges from the chain's sources to its sink.
std::vector<std::vector<TaskId>> task_paths(const Graph& graph, const GraphTasks& tasks, const Chain& chain) {
  const auto node_of = [&](TaskId id) { return graph.nodes[tasks.origin[id].node].name; };
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  std::vector<std::vector<TaskId>> paths;
  std::vector<TaskId> path;
  const std::function<void(TaskId)> walk = [&](TaskId id) {
    if (!has(chain.nodes, node_of(id))) return;
    path.push_back(id);
    if (node_of(id) == chain.sink) {
      paths.push_back(path);
    } else {
      for (const TaskId next : tasks.set[id].feeds) walk(next);
    }
    path.pop_back();
  };
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.origin[id].input && has(chain.sources, node_of(id))) walk(id);
  }
  return paths;
}

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
    auto& bound = out.chains.emplace_back();
    if (chain.sources.size() != 1) continue;
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const TaskOrigin origin = tasks.origin[sequences[i].id];
      if (!origin.input && graph.nodes[origin.node].name == chain.sources.front())
        bound = duration(response[i]);
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

std::optional<std::string> refusal_of(const Graph& graph) {
  const auto found = std::find_if(graph.nodes.begin(), graph.nodes.end(),
                                  [](const Node& n) { return n.type == NodeType::callbacks; });
  if (found == graph.nodes.end()) return std::nullopt;
  return "no method of this version covers nodes of type callbacks, such as " + found->name;
}

std::vector<BoundSet> bounds_of(const Graph& graph, const GraphTasks& tasks, const ExecutorEntry& executor,
                                Duration delta) {
  if (const auto refusal = refusal_of(graph)) return {{std::string(executor.name), "none", {}, {}, *refusal}};
  if (is_default_executor(executor)) {
    return {attempt(executor, "Teper 2024", [&](BoundSet& s) { bound_default(graph, tasks, s); })};
  }
  const std::optional<Policy> policy = analysed_policy(executor);
  if (!policy) {
    return {{std::string(executor.name), "none", {}, {}, "no published bound covers this executor"}};
  }
  const bool timers_only = std::ranges::count(tasks.set.tasks, TaskKind::subscription, &Task::kind) == 0;
  const bool fixed = policy == Policy::rm || policy == Policy::dm || policy == Policy::fp;
  if (!timers_only && fixed && release_mode(executor) == ReleaseMode::release_only) {
    return {attempt(executor, "Buttazzo 2013 (sequences)",
                    [&](BoundSet& s) { bound_sequences(graph, tasks, *policy, s); })};
  }
  std::vector<BoundSet> sets;
  for (const NamedAnalysis& a : analyses(*policy)) {
    sets.push_back(attempt(executor, a.method, [&](BoundSet& s) {
      bound_periodic(tasks, executor, *policy, delta, a.analysis, s);
    }));
  }
  return sets;
}

std::vector<ChainBound> timer_chain_bounds(const GraphTasks& tasks, const ExecutorEntry& executor,
                                           Duration delta, const std::vector<std::string>& names) {
  std::vector<ChainBound> bounds;
  const auto add = [&](const char* method, const std::function<std::int64_t()>& latency) {
    ChainBound& b = bounds.emplace_back();
    b.method = method;
    try {
      b.latency = Duration(latency());
    } catch (const AnalysisError& error) {
      b.refusal = error.what();
    }
  };
  if (is_default_executor(executor)) {
    const ExecutorCallbacks callbacks = executor_callbacks(tasks.set);
    const PeriodicTasks in_order = periodic_tasks(tasks.set, Policy::fifo);  // by task, as the wait set
    const TaskChain chain = task_chain(in_order, names, Revisits::allowed);
    add("Teper 2024", [&] { return teper_2024(callbacks, chain); });
    return bounds;
  }
  const std::optional<Policy> policy = analysed_policy(executor);
  if (!policy) return bounds;
  const PeriodicTasks periodic = periodic_tasks(tasks.set, *policy);
  const TaskChain chain = task_chain(periodic, names, Revisits::allowed);
  const Priorities priorities =
      *policy == Policy::edf || *policy == Policy::fifo ? Priorities::dynamic : Priorities::fixed;
  for (const NamedAnalysis& a : analyses(*policy)) {
    const OverheadAwareResponse r =
        with_release_overhead(periodic, delta.count(), release_mode(executor), a.analysis);
    const std::string with = std::string(", ") + a.method;
    add(("Davare 2007" + with).c_str(), [&] { return davare_2007(r.tasks, r.bounds, chain); });
    add(("Duerr 2019" + with).c_str(),
        [&] { return duerr_2019_reaction_time(r.tasks, r.bounds, chain, priorities); });
    add(("Kloda 2018" + with).c_str(), [&] { return kloda_2018(r.tasks, r.bounds, chain, priorities); });
    add(("Guenzel 2023" + with).c_str(), [&] { return guenzel_2023(r.tasks, r.bounds, chain, priorities); });
  }
  return bounds;
}

}  // namespace hotpath
