// SPDX-License-Identifier: Apache-2.0
#include "advise/candidates.hpp"

#include <algorithm>
#include <iostream>
#include <set>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_chains.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::advise {

namespace {

using program::concat;

constexpr int kChainPriority = 60;  ///< SCHED_FIFO, of the first thread of a chain.
constexpr int kMostPriority = 89;   ///< Timer threads are above.

/// The simulator has one machine for all: a deployment has the costs of its first executor.
Graph with_reference_costs(Graph graph, const setup::ExecutorSpec& spec) {
  const ReferenceCosts& costs = setup::parts(spec).front().entry->traits.reference;
  graph.platform.set_dispatch_costs(costs.dispatch);
  graph.platform.wait_cost = costs.wait;
  graph.platform.wait_cost_per_entity = costs.wait_per_entity;
  graph.platform.wake_up_latency = costs.wake_up;
  return graph;
}

/// Whether the graph has what distinguishes the executor from others.
bool suits(const ExecutorTraits& traits, const TaskSet& set) {
  const auto has_priority = [](const Task& t) { return t.priority.has_value(); };
  const auto has_deadline = [](const Task& t) { return t.kind == TaskKind::timer && t.deadline != t.period; };
  if (traits.policy == Policy::fp) return std::ranges::any_of(set.tasks, has_priority);
  return traits.policy != Policy::dm || std::ranges::any_of(set.tasks, has_deadline);
}

/// The candidates of one graph, each name once.
class Candidates {
 public:
  Candidates(const Graph& graph, const CandidateOptions& options)
      : graph_(graph), tasks_(make_tasks(graph)), options_(options) {}

  void add_named() {
    for (const std::string& name : options_.executors) add_executor(name);
    for (const std::string& name : options_.deployments) add_deployment(name);
  }

  void add_suitable() {
    for (const ExecutorEntry& entry : executors()) {
      if (!suits(entry.traits, tasks_.set)) continue;
      const std::string name(entry.name);
      const unsigned threads = std::min(graph_.platform.cores, most_threads(entry.traits));
      const bool many = entry.traits.many_workers, polled = entry.traits.timers == TimerHandling::polled;
      if (!many) add_executor(name);
      if (many && !polled) add_executor(name + ":1");
      if (many && threads > 1) add_executor(concat(name, ":", threads));
    }
    for (const DeploymentPreset& preset : deployment_presets()) {
      if (preset.name != "single") add_deployment(std::string(preset.name));  // the same as `default`
    }
  }

  /// Those that favour a chain.
  void add_for(const ChainIndex& chain, const std::string& name) {
    std::set<TaskId> members;
    for (const auto& node : chain.nodes) members.insert(node.begin(), node.end());
    add_chain_priorities(members, name);
    if (graph_.platform.cores == 1) return;
    std::set<std::uint32_t> groups;
    for (const TaskId id : members) groups.insert(tasks_.set[id].group);
    add_chain_first(groups, name);
    add_chain_threads(along(chain, members), name);
  }

  void add_current() {
    if (has(options_.now)) return;
    const bool executor = find_executor(results::ExecutorLabel(options_.now).name) != nullptr;
    executor ? add_executor(options_.now) : add_deployment(options_.now);
  }

  std::vector<Candidate> take() { return std::move(all_); }
  [[nodiscard]] const GraphTasks& tasks() const { return tasks_; }

 private:
  bool has(const std::string& name) const {
    return std::ranges::find(all_, name, &Candidate::name) != all_.end();
  }

  void add_executor(const std::string& name) {
    const setup::ExecutorSpec spec = setup::parse_executor(name, options_.scheduling);
    add(spec, graph_, std::string(spec.entry->description));
  }
  void add_deployment(const std::string& name) {
    add_deployment(setup::deploy(name, graph_, tasks_, options_.scheduling));
  }
  void add_deployment(const setup::ExecutorSpec& spec) {
    add(spec, graph_, spec.deployment->plan.description);
  }

  void add(const setup::ExecutorSpec& spec, const Graph& graph, const std::string& description,
           bool sets_priorities = false) {
    if (has(spec.label)) return;
    const Candidate candidate{spec.label, description, {}, {}, spec, sets_priorities, {}};
    all_.push_back(
        with_graph(candidate, options_.reference_costs ? with_reference_costs(graph, spec) : graph));
  }

  /// Priorities: timers of the chain first, then by period.
  void add_chain_priorities(const std::set<TaskId>& chain, const std::string& name) {
    Graph graph = graph_;
    std::set<Duration> periods;
    for (const Task& task : tasks_.set.tasks) periods.insert(task.period);
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const TaskOrigin& origin = tasks_.origin[id];
      const bool timer = tasks_.set[id].kind == TaskKind::timer;
      std::optional<std::int64_t>& priority = graph.nodes[origin.node].callbacks[origin.callback].priority;
      priority.reset();  // subscriptions inherit
      const auto rank = std::distance(periods.begin(), periods.find(tasks_.set[id].period));
      if (timer) priority = chain.contains(id) ? 1 : 100 + rank;
    }
    setup::ExecutorSpec spec = setup::parse_executor("fp-ro", options_.scheduling);
    spec.label = "fp-ro:chain";
    add(spec, graph, "fixed priorities, timers of " + name + " first", true);
  }

  void add_chain_first(const std::set<std::uint32_t>& groups, const std::string& name) {
    Deployment d;
    d.name = "chain-first";
    d.description = concat("callback groups of ", name, " on a separate thread above all others");
    const ThreadPolicy above{ThreadPolicy::Class::fifo, kChainPriority};
    d.executors.push_back({"chain", std::string(kBaselineExecutor), above, {}, 0});
    d.executors.push_back({"rest", std::string(kBaselineExecutor), {}, {}, 0});
    for (const Task& task : tasks_.set.tasks) d.executor_of.push_back(groups.contains(task.group) ? 0 : 1);
    if (std::ranges::count(d.executor_of, 1U) > 0)
      add_deployment(setup::deploy(std::move(d), options_.scheduling));
  }

  /// Priorities rise along the chain, so that started work is finished first (PiCAS).
  void add_chain_threads(const std::vector<TaskId>& along, const std::string& name) {
    Deployment d = find_deployment("cie", graph_, tasks_);
    d.name = "cie:chain";
    d.description = concat("CallbackIsolatedExecutor, threads of ", name, " above all others");
    int priority = kChainPriority;
    for (const TaskId id : along) {
      ThreadPolicy& policy = d.executors[d.executor_of[id]].policy;
      if (policy.ordinary()) policy = {ThreadPolicy::Class::fifo, std::min(kMostPriority, priority++)};
    }
    add_deployment(setup::deploy(std::move(d), options_.scheduling));
  }

  /// The chain's tasks in the order of the data flow.
  std::vector<TaskId> along(const ChainIndex& chain, const std::set<TaskId>& members) const {
    std::vector<TaskId> order = chain.sources;
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (const TaskId next : tasks_.downstream(order[i])) {
        if (members.contains(next) && std::ranges::count(order, next) == 0) order.push_back(next);
      }
    }
    return order;
  }

  const Graph& graph_;
  const GraphTasks tasks_;
  const CandidateOptions& options_;
  std::vector<Candidate> all_;
};

Graph graph_of(const Options& options) {
  constexpr std::size_t kMostChains = 8;
  Graph graph = setup::graph_to_run(options);
  if (options.cores) graph.platform.cores = *options.cores;
  if (!graph.chains.empty()) return graph;
  graph.chains = find_chains(graph, make_tasks(graph), kMostChains);
  for (const Chain& chain : graph.chains)
    std::cout << "Found " << chain.name << ": " << program::joined(chain.nodes, " -> ") << "\n";
  return graph;
}

}  // namespace

std::vector<Candidate> make_candidates(const Graph& graph, const Objective& objective,
                                       const CandidateOptions& options) {
  Candidates candidates(graph, options);
  candidates.add_named();
  if (options.executors.empty() && options.deployments.empty()) {
    candidates.add_suitable();
    if (!graph.chains.empty()) {
      candidates.add_for(index_chains(graph, candidates.tasks())[objective.chain],
                         graph.chains[objective.chain].name);
    }
  }
  candidates.add_current();
  return candidates.take();
}

Candidate with_graph(Candidate c, Graph graph) {
  c.graph = std::move(graph);
  c.tasks = make_tasks(c.graph);
  c.load = setup::utilisation(c.graph, c.tasks, &c.spec);
  return c;
}

Question::Question(const Options& given, Objective::Statistic usual)
    : options(given),
      graph(graph_of(given)),
      tasks(make_tasks(graph)),
      objective(parse_objective(
          given.objective.value_or(graph.chains.empty() ? "worst_lateness" : "hot_path:age"), graph, usual)),
      folder(setup::output_folder(given, graph)) {
  for (const std::string& sentence : setup::utilisation(graph, tasks, nullptr).warnings)
    std::cerr << "note: " << sentence << "\n";
}

std::vector<Candidate> Question::candidates(bool reference_costs) const {
  program::check_output_folder(folder);
  return make_candidates(graph, objective,
                         {.executors = options.executors,
                          .deployments = options.deployments,
                          .now = options.now,
                          .scheduling = setup::scheduling_of(options, graph, tasks.set, graph.platform.cores),
                          .reference_costs = options.reference_costs.value_or(reference_costs)});
}

const Candidate& Question::now(const std::vector<Candidate>& candidates) const {
  // A deployment from a file has the name in the file, and is the last candidate.
  const auto named = std::ranges::find(candidates, options.now, &Candidate::name);
  return named == candidates.end() ? candidates.back() : *named;
}

void Question::finish(const nlohmann::json& content) const {
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
  program::show_json(content);
}

}  // namespace hotpath::advise
