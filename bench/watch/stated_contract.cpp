// SPDX-License-Identifier: Apache-2.0
#include "watch/stated_contract.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "hotpath/analysis/observable_limits.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "setup/deployed_system.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::watch {

namespace {

/// Minimum distances are stated to the next, second and third next publication.
constexpr std::int64_t kDistances = 3;
/// Bounds assume that threads never wait; an idle machine lets them wait less than this in a second.
constexpr Duration kWait = std::chrono::milliseconds(1);

/// The callbacks' names and publications, by task.
std::vector<CallbackContract> named_callbacks(const Graph& graph, const GraphTasks& tasks) {
  std::vector<CallbackContract> all;
  std::map<std::uint32_t, std::uint32_t> timers;  // by node
  for (TaskId task = 0; task < tasks.set.size(); ++task) {
    const TaskOrigin& origin = tasks.origin[task];
    const Node& node = graph.nodes[origin.node];
    CallbackContract& callback = all.emplace_back();
    callback.node = node.name;
    if (origin.input) callback.topic = node.inputs[*origin.input].topic;
    callback.service = tasks.callbacks[task].entity == EntityKind::service;
    if (!origin.input) callback.timer = ++timers[origin.node];
    for (const Publication& p : tasks.callbacks[task].publishes) {
      StatedPublication& publication = callback.publishes.emplace_back(StatedPublication{p.topic});
      for (const std::uint32_t input : p.of) publication.with.push_back(node.inputs[input].topic);
    }
  }
  return all;
}

ObservedSystem observed_system(const Graph& graph, const GraphTasks& tasks,
                               const setup::ExecutorSpec& executor,
                               const std::optional<bounds::Guarantees>& bounds) {
  const Deployment* const plan = executor.deployment ? &executor.deployment->plan : nullptr;
  const std::size_t count = tasks.set.size();
  ObservedSystem system{tasks.set, setup::threads_of(graph, setup::parts(executor), plan),
                        plan ? plan->executor_of : std::vector<std::uint32_t>(count),
                        make_platform(graph, *setup::parts(executor).front().entry)};
  system.responses.resize(count);
  system.always.resize(count);
  for (TaskId task = 0; task < count; ++task) {
    if (bounds && bounds->tasks[task]) system.responses[task] = Duration(bounds->tasks[task]->ns);
    const std::vector<Publication>& publishes = tasks.callbacks[task].publishes;
    for (const TaskId reader : tasks.set[task].feeds) {
      const TaskOrigin& origin = tasks.origin[reader];
      const std::string& topic = graph.nodes[origin.node].inputs[*origin.input].topic;
      const auto published = std::ranges::find(publishes, topic, &Publication::topic);
      system.always[reader] = published != publishes.end() && published->rule == PublishRule::always;
    }
  }
  return system;
}

std::vector<Term> terms_of(const ObservedSystem& system, TaskId task, const Callback& callback) {
  std::vector<Term> terms;
  const auto derived = [&](Clause clause, std::optional<Duration> limit) {
    if (limit) terms.push_back({clause, limit->count(), Origin::derived});
  };
  const Task& of = system.set[task];
  if (const auto longest = longest_run(system, task)) {
    const bool measured = callback.measured != nullptr || !callback.quantiles.empty();
    derived(Clause::budget, longest);
    if (*longest <= of.wcet) terms.back().origin = measured ? Origin::measured : Origin::given;
  }
  if (of.kind == TaskKind::timer) {
    terms.push_back({Clause::period, of.period.count()});
  } else {
    terms.push_back({Clause::depth, of.depth});
    if (shortest_distance(system, task, kDistances) > Duration::zero()) {
      derived(Clause::minimum_distance, shortest_distance(system, task, 1));
      for (std::int64_t k = 2; k <= kDistances; ++k)
        terms.back().further.push_back(shortest_distance(system, task, k).count());
    }
    if (loses_nothing(system, task)) derived(Clause::lost, Duration::zero());
  }
  derived(Clause::maximum_distance, longest_distance(system, task));
  terms.push_back({Clause::publishes});
  // A job without work has a bound of 0 in a graph without costs; no live job keeps it.
  if (system.responses[task] > Duration::zero()) derived(Clause::response, system.responses[task]);
  return terms;
}

std::vector<ChainContract> chains_of(const Graph& graph, const GraphTasks& tasks,
                                     const std::optional<bounds::Guarantees>& bounds) {
  std::vector<ChainContract> all;
  for (const ChainIndex& index : index_chains(graph, tasks)) {
    ChainContract& chain = all.emplace_back(ChainContract{graph.chains[all.size()].name});
    chain.sources.assign(index.sources.begin(), index.sources.end());
    chain.sinks.assign(index.sink_tasks.begin(), index.sink_tasks.end());
    const bounds::ChainGuarantee* const bound = bounds ? bounds->chain(chain.name) : nullptr;
    if (bound && bound->hot_path)
      chain.terms.push_back({Clause::hot_path, bound->hot_path->ns, Origin::derived});
    if (bound && bound->age) chain.terms.push_back({Clause::age, bound->age->ns, Origin::derived});
  }
  return all;
}

std::vector<ThreadContract> threads_of(const ObservedSystem& system, const setup::ExecutorSpec& executor) {
  std::vector<ThreadContract> all;
  for (std::size_t e = 0; e < system.threads.size(); ++e) {
    ThreadContract thread{executor.label};
    for (TaskId task = 0; task < system.set.size(); ++task)
      if (system.executor_of[task] == e) thread.callbacks.push_back(task);
    if (thread.callbacks.empty()) continue;
    if (executor.deployment) {
      const DeployedExecutor& plan = executor.deployment->plan.executors[e];
      thread.name = plan.name;
      thread.terms.push_back({.clause = Clause::policy, .policy = plan.policy});
      if (!plan.processors.empty())
        thread.terms.push_back({.clause = Clause::processors, .processors = plan.processors});
    }
    // Others of the contract may let them wait for any time.
    if (never_waits(system, e)) thread.terms.push_back({Clause::wait, kWait.count()});
    all.push_back(std::move(thread));
  }
  return all;
}

}  // namespace

Contract stated_contract(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor) {
  const auto bounds = setup::guarantees(graph, tasks, executor);
  const ObservedSystem system = observed_system(graph, tasks, executor, bounds);
  Contract contract{named_callbacks(graph, tasks), chains_of(graph, tasks, bounds),
                    threads_of(system, executor)};
  for (TaskId task = 0; task < tasks.set.size(); ++task)
    contract.callbacks[task].terms = terms_of(system, task, tasks.callbacks[task]);
  const auto premises = setup::premises(graph, tasks.set, executor, false);
  contract.rests_on = bounds::list_of(premises, true);
  contract.assumed = bounds::list_of(premises, false);
  return contract;
}

Contract stated_contract(const guarantees::AnalyzeOptions& options) {
  if (options.executors.size() + options.deployments.size() != 1) {
    throw program::UsageError(
        "--contract: a contract holds under one executor or deployment; name it, for example --executors "
        "rm-ro");
  }
  Graph graph = setup::graph_to_run(options);
  options.apply_to(graph.platform);
  const GraphTasks tasks = make_tasks(graph);
  return stated_contract(graph, tasks, setup::executors_to_run(options, graph, tasks).front());
}

}  // namespace hotpath::watch
