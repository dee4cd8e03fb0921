// SPDX-License-Identifier: Apache-2.0
#include "advise/candidates.hpp"

#include <algorithm>
#include <numeric>
#include <set>

#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::advise {

namespace {

constexpr int kChainPriority = 60;  ///< SCHED_FIFO, of the first thread of a chain.
constexpr int kMostPriority = 89;   ///< Timer threads are above.

double mean_ms(const Callback& callback, ExecutionTimeModel model) {
  if (model == ExecutionTimeModel::worst) return to_ms(callback.worst);
  if (model != ExecutionTimeModel::uniform && callback.measured) {
    const double sum = std::accumulate(callback.measured->begin(), callback.measured->end(), 0.0,
                                       [](double s, Duration d) { return s + to_ms(d); });
    return sum / static_cast<double>(callback.measured->size());
  }
  return (to_ms(callback.worst) + to_ms(callback.best)) / 2;
}

/// The load of each task, in cores.
std::vector<double> loads(const Graph& graph, const GraphTasks& tasks) {
  std::vector<double> loads = activation_rates(tasks);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    loads[id] *= mean_ms(tasks.callbacks[id], graph.platform.execution_times) / 1e3;
  }
  return loads;
}

/// The tasks of a chain of the graph.
std::set<TaskId> tasks_of_chain(const Graph& graph, const GraphTasks& tasks, std::size_t chain) {
  std::set<TaskId> members;
  const ChainIndex index = index_chains(graph, tasks)[chain];
  for (const auto& node : index.nodes) members.insert(node.begin(), node.end());
  return members;
}

class Candidates {
 public:
  Candidates(const Graph& graph, const Objective& objective, const CandidateOptions& options)
      : graph_(graph), tasks_(make_tasks(graph)), objective_(objective), options_(options) {}

  std::vector<Candidate> all() {
    const bool named = !options_.executors.empty() || !options_.deployments.empty();
    for (const std::string& name : options_.executors) add_executor(name);
    for (const std::string& name : options_.deployments) add_deployment(name);
    if (!named) {
      for (const ExecutorEntry& entry : executors()) add_suitable(entry);
      for (const DeploymentPreset& preset : deployment_presets()) {
        if (preset.name != "single") add_deployment(std::string(preset.name));  // the same as `default`
      }
      if (!graph_.chains.empty()) add_for_chain();
    }
    if (!has(options_.now)) {
      is_executor(options_.now) ? add_executor(options_.now) : add_deployment(options_.now);
    }
    return std::move(all_);
  }

 private:
  static bool is_executor(const std::string& name) {
    return find_executor(results::ExecutorLabel(name).name) != nullptr;
  }
  bool has(const std::string& name) const {
    return std::ranges::any_of(all_, [&](const Candidate& c) { return c.name == name; });
  }

  void add_suitable(const ExecutorEntry& entry) {
    const auto any = [&](auto condition) { return std::ranges::any_of(tasks_.set.tasks, condition); };
    const ExecutorTraits& traits = entry.traits;
    if (traits.policy == Policy::fp && !any([](const Task& t) { return t.priority.has_value(); })) return;
    const auto other_deadline = [](const Task& t) {
      return t.kind == TaskKind::timer && t.deadline != t.period;
    };
    if (traits.policy == Policy::dm && !any(other_deadline)) return;
    const std::string name(entry.name);
    if (!traits.many_workers) return add_executor(name);
    const bool queue = traits.timers != TimerHandling::polled;
    if (queue) add_executor(name + ":1");
    const unsigned threads = std::min(graph_.platform.cores, most_threads(traits));
    if (threads > 1) add_executor(program::concat(name, ":", threads));
  }

  void add_executor(const std::string& name) {
    const setup::ExecutorSpec spec = setup::parse_executor(name, options_.scheduling);
    add(spec, graph_, std::string(spec.entry->description));
  }

  void add_deployment(const std::string& name) {
    const setup::ExecutorSpec spec = setup::deploy(name, graph_, tasks_, options_.scheduling);
    add(spec, graph_, spec.deployment->plan.description);
  }

  void add(setup::ExecutorSpec spec, Graph graph, std::string description) {
    if (has(spec.label)) return;
    Candidate c;
    c.name = spec.label;
    c.description = std::move(description);
    if (options_.reference_costs) {
      // The simulator has one machine for all: a deployment has the costs of its first executor.
      const ReferenceCosts& costs = setup::parts(spec).front().entry->traits.reference;
      graph.platform.set_dispatch_costs(costs.dispatch);
      graph.platform.wait_cost = costs.wait;
      graph.platform.wait_cost_per_entity = costs.wait_per_entity;
      graph.platform.wake_up = costs.wake_up;
    }
    c.graph = std::move(graph);
    c.spec = std::move(spec);
    weigh(c);
    all_.push_back(std::move(c));
  }

  void add_for_chain() {
    const std::set<TaskId> chain = tasks_of_chain(graph_, tasks_, objective_.chain);
    const std::string name = graph_.chains[objective_.chain].name;
    add_chain_priorities(chain, name);
    if (graph_.platform.cores == 1) return;
    std::set<std::uint32_t> groups;
    for (const TaskId id : chain) groups.insert(tasks_.set[id].group);
    add_chain_first(groups, name);
    add_chain_threads(groups, name);
  }

  /// Priorities: timers of the chain first, then by period.
  void add_chain_priorities(const std::set<TaskId>& chain, const std::string& name) {
    Graph graph = graph_;
    std::set<Duration> periods;
    for (const Task& task : tasks_.set.tasks) periods.insert(task.period);
    const auto rank = [&](Duration period) {
      return 100 + std::distance(periods.begin(), periods.find(period));
    };
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const TaskOrigin& origin = tasks_.origin[id];
      const bool timer = tasks_.set[id].kind == TaskKind::timer;
      std::optional<std::int64_t>& priority = graph.nodes[origin.node].callbacks[origin.callback].priority;
      priority.reset();  // subscriptions inherit
      if (timer) priority = chain.contains(id) ? 1 : rank(tasks_.set[id].period);
    }
    setup::ExecutorSpec spec = setup::parse_executor("fp-ro", options_.scheduling);
    spec.label = "fp-ro:chain";
    add(std::move(spec), std::move(graph), "fixed priorities, timers of " + name + " first");
    all_.back().sets_priorities = true;
  }

  void add_chain_first(const std::set<std::uint32_t>& groups, const std::string& name) {
    Deployment d;
    d.name = "chain-first";
    d.description = program::concat("callback groups of ", name, " on a separate thread above all others");
    const ThreadPolicy above{ThreadPolicy::Class::fifo, kChainPriority};
    d.executors.push_back({"chain", std::string(kBaselineExecutor), above, {}, 0});
    d.executors.push_back({"rest", std::string(kBaselineExecutor), {}, {}, 0});
    for (const Task& task : tasks_.set.tasks) d.executor_of.push_back(groups.contains(task.group) ? 0 : 1);
    if (std::ranges::count(d.executor_of, 1U) > 0) add_generated(std::move(d));
  }

  /// Priorities rise along the chain, so that started work is finished first (PiCAS).
  void add_chain_threads(const std::set<std::uint32_t>& groups, const std::string& name) {
    Deployment d = find_deployment("cie", graph_, tasks_);
    d.name = "cie:chain";
    d.description = program::concat("CallbackIsolatedExecutor, threads of ", name, " above all others");
    int priority = kChainPriority;
    for (const TaskId id : along_chain()) {
      DeployedExecutor& executor = d.executors[d.executor_of[id]];
      if (!groups.contains(tasks_.set[id].group) || !executor.policy.ordinary()) continue;
      executor.policy = {ThreadPolicy::Class::fifo, std::min(kMostPriority, priority++)};
    }
    add_generated(std::move(d));
  }

  void add_generated(Deployment d) {
    std::string description = d.description;
    add(setup::deploy(std::move(d), options_.scheduling), graph_, std::move(description));
  }

  /// The chain's tasks in the order of the data flow.
  std::vector<TaskId> along_chain() const {
    const ChainIndex index = index_chains(graph_, tasks_)[objective_.chain];
    const std::set<TaskId> members = tasks_of_chain(graph_, tasks_, objective_.chain);
    std::vector<TaskId> order = index.sources;
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (const TaskId next : tasks_.downstream(order[i])) {
        if (members.contains(next) && std::ranges::count(order, next) == 0) order.push_back(next);
      }
    }
    return order;
  }

  const Graph& graph_;
  const GraphTasks tasks_;
  const Objective& objective_;
  const CandidateOptions& options_;
  std::vector<Candidate> all_;
};

}  // namespace

std::vector<Candidate> make_candidates(const Graph& graph, const Objective& objective,
                                       const CandidateOptions& options) {
  return Candidates(graph, objective, options).all();
}

void weigh(Candidate& c) {
  c.tasks = make_tasks(c.graph);
  c.threads = 0;
  c.overload.clear();
  const std::vector<double> load = loads(c.graph, c.tasks);
  const std::span<const setup::ExecutorSpec> executors = setup::parts(c.spec);
  std::vector<double> of_executor(executors.size(), 0);
  for (TaskId id = 0; id < load.size(); ++id) {
    of_executor[c.spec.deployment ? c.spec.deployment->plan.executor_of[id] : 0] += load[id];
  }
  for (std::size_t e = 0; e < executors.size(); ++e) {
    const TimerHandling timers = executors[e].entry->traits.timers;
    const bool only_releases = timers == TimerHandling::release_only || timers == TimerHandling::marked_ready;
    const unsigned threads =
        worker_count(*executors[e].entry, executors[e].scheduler) - (only_releases ? 1 : 0);
    c.threads += threads;
    if (of_executor[e] < std::min(threads, c.graph.platform.cores) || !c.overload.empty()) continue;
    const std::string subject =
        c.spec.deployment ? program::concat("executor ", c.spec.deployment->plan.executors[e].name) : "it";
    c.overload =
        program::concat(subject, " has ", program::fixed(100 * of_executor[e], 0),
                        " % of one core of work for ", threads, threads == 1 ? " thread" : " threads");
  }
}

double mean_load_percent(const Graph& graph, const GraphTasks& tasks) {
  const std::vector<double> of_task = loads(graph, tasks);
  return 100 * std::accumulate(of_task.begin(), of_task.end(), 0.0);
}

}  // namespace hotpath::advise
