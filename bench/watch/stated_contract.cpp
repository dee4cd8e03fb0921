// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hotpath/analysis/observable_limits.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "setup/deployed_system.hpp"
#include "setup/executor_spec.hpp"
#include "setup/stored_system.hpp"
#include "simulated/own_times.hpp"
#include "watch/contract.hpp"
#include "watch/job_times.hpp"

namespace hotpath::watch {

namespace {

/// Minimum distances are stated to the next, second and third next publication.
constexpr std::int64_t kDistances = 3;
/// Bounds assume that threads never wait; an idle machine lets them wait less than this in a second.
constexpr Duration kWait = std::chrono::milliseconds(1);
/// A trace does not tell how long threads waited.
constexpr Duration kRecordedWait = std::chrono::milliseconds(300);
/// By which recorded limits exceed the worst values.
constexpr Duration kLeastMargin = std::chrono::milliseconds(5);

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
                               const setup::ExecutorSpec& executor, const bounds::Guarantees& bounds) {
  const std::size_t count = tasks.set.size();
  ObservedSystem system{tasks.set, setup::threads_of(graph, executor), executor.plan.executor_of,
                        make_platform(graph, *setup::parts(executor).front().entry)};
  system.executor_of.resize(count);
  system.responses.resize(count);
  system.always.resize(count);
  for (TaskId task = 0; task < count; ++task) {
    if (const auto bound = bounds.of(Latency::response, tasks.set[task].name))
      system.responses[task] = Duration(bound->ns);
    const std::vector<Publication>& publishes = tasks.callbacks[task].publishes;
    for (std::size_t p = 0; p < publishes.size(); ++p)
      for (const TaskId reader : tasks.readers[task][p])
        system.always[reader] = publishes[p].rule == PublishRule::always;
  }
  return system;
}

/// States which topics a job may publish several times: it did, or joins messages like a synchroniser, which
/// completes several sets at once if it was delayed.
void allow_several(Contract& contract, const Trace& trace, const GraphTasks& tasks) {
  std::set<std::tuple<TaskId, TaskId, std::uint64_t>> taken;
  std::set<std::pair<TaskId, std::string>> several;
  for (const JobRecord& r : trace.jobs)
    if (!is_of_timer(r.job) && !taken.emplace(r.job.task, r.job.parent.task, r.job.parent.sequence).second)
      several.emplace(r.job.parent.task, contract.callbacks[r.job.task].topic);
  for (TaskId task = 0; task < tasks.set.size(); ++task)
    for (std::size_t p = 0; p < tasks.callbacks[task].publishes.size(); ++p) {
      StatedPublication& stated = contract.callbacks[task].publishes[p];
      stated.several = tasks.callbacks[task].publishes[p].rule == PublishRule::all_new ||
                       several.contains({task, stated.topic});
    }
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

/// What a run recorded of a callback.
struct Recorded {
  Duration run{}, own{}, response{};  ///< The longest; `own`: without the jobs that displaced it.
  std::vector<Time> arrivals = {};    ///< Starts of timers and services, publications of samples.
  Duration distance{};                ///< The longest between two of them.
  /// Whether it is a timer's, or so even that a longer one tells of a fault.
  bool regular = false;
};

/// Adds the `own` times, as the check of budgets sees them. Those of an import are shorter: it knows the
/// turns that ordinary threads take.
void add_own_times(const Trace& trace, std::vector<Recorded>& all) {
  RunningJobs running;
  simulated::for_each_change(trace, [&](std::size_t i, Time, bool begins) {
    const JobRecord& r = trace.jobs[i];
    const tracing::Job job{{r.job.task, r.job.sequence}, r.worker, r.cpu, r.start, r.finish};
    if (begins) return running.start(job, std::nullopt);
    Duration& own = all[r.job.task].own;
    own = std::max(own, r.duration() - running.end(job).displaced);
  });
}

std::vector<Recorded> recorded_tasks(const Trace& trace, const GraphTasks& tasks) {
  constexpr std::int64_t kLeastJobs = 10, kMostUneven = 3;
  std::vector<Recorded> all(tasks.set.size());
  add_own_times(trace, all);
  for (const JobRecord& job : trace.jobs) {
    Recorded& of = all[job.job.task];
    const Task& task = tasks.set[job.job.task];
    const bool sample = task.kind != TaskKind::timer && task.entity != EntityKind::service;
    if (sample || job.started()) of.arrivals.push_back(sample ? job.job.timestamp : job.start);
    if (job.outcome != Outcome::ran) continue;
    of.run = std::max(of.run, job.duration());
    of.response = std::max(of.response, job.response_time());
  }
  for (TaskId task = 0; task < all.size(); ++task) {
    Recorded& of = all[task];
    const bool timer = tasks.set[task].kind == TaskKind::timer;
    if (timer) of.distance = tasks.set[task].period;
    std::ranges::sort(of.arrivals);
    for (std::size_t i = 1; i < of.arrivals.size(); ++i)
      of.distance = std::max(of.distance, of.arrivals[i] - of.arrivals[i - 1]);
    const auto count = static_cast<std::int64_t>(of.arrivals.size());
    of.regular = timer || (count >= kLeastJobs &&
                           of.distance <= (of.arrivals.back() - of.arrivals.front()) / count * kMostUneven);
  }
  return all;
}

/// `others`: one job of each other callback of the executor. In another run, where timers have other phases,
/// a job may wait for them. Limits exceed the worst recorded values by the margin.
std::vector<Term> recorded_terms(const Recorded& recorded, const Task& task, Duration others,
                                 double margin_percent) {
  std::vector<Term> terms = {{Clause::publishes}};
  const bool service = task.entity == EntityKind::service, timer = task.kind == TaskKind::timer;
  if (recorded.arrivals.empty() || (!service && task.entity != EntityKind::subscription)) return terms;
  const auto measured = [&](Clause clause, Duration worst) {
    const Duration margin(std::llround(static_cast<double>(worst.count()) * margin_percent / 100));
    terms.push_back({clause, (worst + std::max(margin, kLeastMargin)).count(), Origin::measured});
  };
  measured(Clause::budget, recorded.own);
  if (timer) terms.push_back({Clause::period, task.period.count()});
  if (!timer && !service) terms.push_back({Clause::depth, task.depth});
  if (recorded.regular) measured(Clause::maximum_distance, recorded.distance + others);
  if (!service) measured(Clause::response, recorded.response + others);
  return terms;
}

std::vector<Group> chains_of(const Graph& graph, const GraphTasks& tasks, const bounds::Guarantees& bounds) {
  std::vector<Group> all;
  for (const ChainIndex& index : index_chains(graph, tasks)) {
    Group& chain = all.emplace_back(Group{graph.chains[all.size()].name});
    chain.callbacks.assign(index.sources.begin(), index.sources.end());
    chain.sinks.assign(index.sink_tasks.begin(), index.sink_tasks.end());
    for (const Latency of : {Latency::hot_path, Latency::age})
      if (const auto bound = bounds.of(of, chain.name))
        chain.terms.push_back(
            {of == Latency::age ? Clause::age : Clause::hot_path, bound->ns, Origin::derived});
  }
  return all;
}

/// `system`: nullptr for threads that a trace tells of.
std::vector<Group> threads_of(const setup::ExecutorSpec& executor, const TaskSet& set,
                              const ObservedSystem* system) {
  std::vector<Group> all;
  for (std::uint32_t e = 0; e < setup::parts(executor).size(); ++e) {
    Group thread{executor.label};
    for (TaskId task = 0; task < set.size(); ++task)
      if (executor_of(executor, task) == e) thread.callbacks.push_back(task);
    if (thread.callbacks.empty()) continue;
    if (!executor.entry) {
      const DeployedExecutor& plan = setup::parts(executor)[e].place;
      thread.name = plan.name;
      // A trace does not tell the ordinary policy from others that never displaced a thread.
      if (system || !plan.policy.ordinary())
        thread.terms.push_back({.clause = Clause::policy, .policy = plan.policy});
      if (!plan.processors.empty())
        thread.terms.push_back({.clause = Clause::processors, .processors = plan.processors});
    }
    // Others of the contract may let them wait for any time.
    if (!system || never_waits(*system, e))
      thread.terms.push_back({Clause::wait, (system ? kWait : kRecordedWait).count()});
    all.push_back(std::move(thread));
  }
  return all;
}

}  // namespace

Contract stated_contract(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor) {
  const auto bounds = setup::guarantees(graph, tasks, executor).value_or(bounds::Guarantees());
  const ObservedSystem system = observed_system(graph, tasks, executor, bounds);
  Contract contract{named_callbacks(graph, tasks), chains_of(graph, tasks, bounds),
                    threads_of(executor, tasks.set, &system)};
  for (TaskId task = 0; task < tasks.set.size(); ++task)
    contract.callbacks[task].terms = terms_of(system, task, tasks.callbacks[task]);
  const auto premises = setup::premises(graph, tasks.set, executor, false);
  contract.rests_on = premises.stated;
  contract.assumed = premises.assumed;
  return contract;
}

Contract recorded_contract(const guarantees::AnalyzeOptions& options, double margin_percent) {
  results::StoredRun run(options.trace, "--trace");
  setup::StoredSystem system = setup::stored_system(run, options.graph);
  const GraphTasks& tasks = system.tasks;
  if (system.executors.size() != 1)
    run.fail("a contract holds under one executor or deployment, and it ran " +
             program::joined(run.executors(), ", "));
  run.load(tasks.set);
  const setup::ExecutorSpec& executor = system.executors.front();
  Contract contract{named_callbacks(system.graph, tasks), chains_of(system.graph, tasks, {}),
                    threads_of(executor, tasks.set, nullptr)};
  const Trace& trace = run.trace(executor.label, 0);
  if (run.record().kind == results::RunKind::recorded) allow_several(contract, trace, tasks);
  const std::vector<Recorded> recorded = recorded_tasks(trace, tasks);
  for (const Group& thread : contract.threads) {
    Duration all{};
    for (const TaskId task : thread.callbacks) all += recorded[task].run;
    for (const TaskId task : thread.callbacks)
      contract.callbacks[task].terms =
          recorded_terms(recorded[task], tasks.set[task], all - recorded[task].run, margin_percent);
  }
  contract.assumed = program::concat("measured limits are the worst of ", to_s(run.length()), " s and ",
                                     margin_percent, " % (at least ", to_ms(kLeastMargin), " ms) more");
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
