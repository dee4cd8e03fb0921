// SPDX-License-Identifier: Apache-2.0
#include "advise/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>
#include <sstream>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::advise {

namespace {

using Kind = Objective::Kind;

[[noreturn]] void refuse(const std::string& text) {
  throw program::UsageError(program::concat(
      "--for: `", text,
      "`: give CHAIN:age:median, :p99 or :worst, CHAIN:p99 for its hot path, CHAIN<MS, worst_lateness or "
      "losses"));
}

/// `note` gets what is meant if it is another chain.
std::size_t chain_named(const std::string& name, const Graph& graph, std::string& note) {
  const std::vector<std::string> names = setup::chain_names(graph);
  const auto place = std::ranges::find(names, name);
  if (place != names.end()) return static_cast<std::size_t>(place - names.begin());
  if (name == "hot_path" && !names.empty()) {
    note = "--for: the graph has no chain hot_path; its first chain is meant, " + names.front();
    return 0;
  }
  throw program::UsageError(
      program::concat("--for: the graph has no chain ", name, "; ",
                      names.empty() ? "it names none, and none was found: take worst_lateness or losses"
                                    : "it has " + program::joined(names)));
}

Objective latency_of(const std::string& chain, const std::string& words, const Graph& graph,
                     results::Judged usual) {
  const bool age = words == "age" || words.starts_with("age:");
  const auto statistic = words == "age" ? usual : parse<results::Judged>(age ? words.substr(4) : words);
  if (!statistic) refuse(words);
  Objective objective{.statistic = *statistic, .latency = age ? Latency::age : Latency::hot_path};
  objective.chain = chain_named(chain, graph, objective.note);
  objective.text = program::concat(results::words_of(objective.latency).phrase, " of ",
                                   graph.chains[objective.chain].name, " (", to_string(*statistic), ")");
  return objective;
}

Objective::Requirement requirement(const std::string& text, const Graph& graph, std::string& note) {
  const std::size_t less = text.find('<');
  if (less == std::string::npos) refuse(text);
  Objective::Requirement r;
  r.most_ms = parse<double>(std::string_view(text).substr(less + 1)).value_or(0);
  if (!(r.most_ms > 0)) refuse(text);
  r.chain = chain_named(text.substr(0, less), graph, note);
  return r;
}

double finite(double value) { return std::isnan(value) ? INFINITY : value; }

double worst_lateness(const results::ExecutorSummary& summary) {
  double worst = -INFINITY;
  for (const results::TaskSummary& task : summary.tasks) {
    if (task.kind != TaskKind::timer) continue;
    if (task.never_ran()) return INFINITY;
    if (task.response_ms.n > 0) worst = std::max(worst, task.response_ms.max - to_ms(task.deadline));
  }
  return worst;
}

}  // namespace

Objective parse_objective(const std::optional<std::string>& given, const Graph& graph,
                          results::Judged usual) {
  if (!given && !graph.chains.empty()) return latency_of(graph.chains.front().name, "age", graph, usual);
  const std::string text = given.value_or("worst_lateness");
  if (text == "losses") return {.kind = Kind::losses, .text = "lost jobs and samples"};
  if (text == "worst_lateness") return {.kind = Kind::worst_lateness, .text = "worst lateness of timers"};
  const std::size_t colon = text.find(':');
  if (colon != std::string::npos)
    return latency_of(text.substr(0, colon), text.substr(colon + 1), graph, usual);
  Objective objective{.kind = Kind::requirements, .statistic = results::kWorst};
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    const Objective::Requirement r = requirement(item, graph, objective.note);
    objective.text += program::concat(objective.text.empty() ? "" : ", ", graph.chains[r.chain].name,
                                      " within ", r.most_ms, " ms");
    objective.requirements.push_back(r);
  }
  if (objective.requirements.empty()) refuse(text);
  objective.chain = objective.requirements.front().chain;
  return objective;
}

Score score(const Objective& objective, const results::ExecutorSummary& summary) {
  const double lost = summary.lost_percent();
  switch (objective.kind) {
    case Kind::latency:
      return {finite(summary.chains[objective.chain].latency(objective.latency).quantiles.*
                     traits_of(objective.statistic).of),
              0, lost};
    case Kind::worst_lateness:
      return {worst_lateness(summary), 0, lost};
    case Kind::losses:
      return {lost, 0, worst_lateness(summary)};
    case Kind::requirements:
      break;
  }
  Score score{0};
  for (const Objective::Requirement& r : objective.requirements) {
    const double worst = finite(summary.chains[r.chain].end_to_end.quantiles.max) / r.most_ms;
    score.value += std::max(0.0, 100 * (worst - 1));
    score.tie = std::max(score.tie, worst);
  }
  return score;
}

namespace {

using program::concat;

constexpr int kChainPriority = 60;  ///< SCHED_FIFO, of the first thread of a chain.
constexpr int kMostPriority = 89;   ///< Timer threads are above.

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
  Candidates(const Graph& graph, const Options& options)
      : graph_(graph),
        tasks_(make_tasks(graph)),
        options_(options),
        scheduling_(setup::scheduling_of(options, graph, tasks_.set, graph.platform.cores)),
        now_(find_executor(results::ExecutorLabel(options.now).name) != nullptr ? executor(options.now)
                                                                                : deployment(options.now)) {
    several_processes_ = now_.plan.processes.size() > 1;
  }

  std::vector<Candidate> made(const Objective& objective) {
    for (const std::string& name : options_.executors) add(executor(name));
    for (const std::string& name : options_.deployments) add(deployment(name));
    if (options_.executors.empty() && options_.deployments.empty()) {
      add_suitable();
      if (!graph_.chains.empty()) {
        add_for(index_chains(graph_, tasks_)[objective.chain], graph_.chains[objective.chain].name);
      }
    }
    if (!has(options_.now)) add(now_);
    return std::move(all_);
  }

 private:
  bool has(const std::string& name) const {
    return std::ranges::find(all_, name, &Candidate::name) != all_.end();
  }
  /// Nodes stay in their processes: of several, all of their executors become this one.
  setup::ExecutorSpec executor(const std::string& name) const {
    setup::ExecutorSpec spec = setup::parse_executor(name, scheduling_);
    if (!several_processes_) return spec;
    Deployment plan = now_.plan;
    plan.name = "each:" + name;
    plan.description = concat(spec.entry->description, ", in each process");
    plan.file.clear();
    for (DeployedExecutor& executor : plan.executors) executor.executor = name;
    return setup::deploy(std::move(plan), scheduling_);
  }
  setup::ExecutorSpec deployment(const std::string& name) const {
    return setup::deploy(find_deployment(name, graph_, tasks_), scheduling_);
  }

  void add(const setup::ExecutorSpec& spec) { add({spec.label, spec.plan.description, graph_, spec}); }
  void add(Candidate candidate) {
    if (has(candidate.name)) return;
    Graph graph = std::move(candidate.graph);
    if (options_.reference_costs.value_or(!options_.choose_phases)) {
      // The simulator has one machine for all: a deployment has the costs of its first executor.
      graph.platform.set_costs(setup::parts(candidate.spec).front().entry->traits.reference);
    }
    all_.push_back(with_graph(std::move(candidate), std::move(graph)));
  }

  void add_suitable() {
    for (const ExecutorEntry& entry : executors()) {
      if (!suits(entry.traits, tasks_.set)) continue;
      const std::string name(entry.name);
      const unsigned threads = std::min(graph_.platform.cores, most_threads(entry.traits));
      const bool many = entry.traits.many_workers, polled = entry.traits.timers == TimerHandling::polled;
      if (!many) add(executor(name));
      if (many && !polled) add(executor(name + ":1"));
      if (many && threads > 1) add(executor(concat(name, ":", threads)));
    }
    for (const DeploymentPreset& preset : deployment_presets()) {
      if (preset.name != "single") add(deployment(std::string(preset.name)));  // the same as `default`
    }
  }

  /// Those that favour a chain.
  void add_for(const ChainIndex& chain, const std::string& name) {
    std::set<TaskId> members;
    for (const auto& node : chain.nodes) members.insert(node.begin(), node.end());
    setup::ExecutorSpec fixed = executor("fp-ro");
    fixed.label += ":chain";
    add({fixed.label, "fixed priorities, timers of " + name + " first", with_priorities(members), fixed,
         true});
    if (graph_.platform.cores == 1) return;
    if (!several_processes_) add_chain_first(members, name);
    add_chain_threads(chain, members, name);
  }

  /// The graph with priorities: timers of the chain first, then by period; subscriptions inherit.
  Graph with_priorities(const std::set<TaskId>& chain) const {
    Graph graph = graph_;
    std::set<Duration> periods;
    for (const Task& task : tasks_.set.tasks) periods.insert(task.period);
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const auto [node, callback] = std::pair(tasks_.origin[id].node, tasks_.origin[id].callback);
      std::optional<std::int64_t>& priority = graph.nodes[node].callbacks[callback].priority;
      priority.reset();
      const auto rank = std::distance(periods.begin(), periods.find(tasks_.set[id].period));
      if (tasks_.set[id].kind == TaskKind::timer) priority = chain.contains(id) ? 1 : 100 + rank;
    }
    return graph;
  }

  void add_chain_first(const std::set<TaskId>& members, const std::string& name) {
    std::set<std::uint32_t> groups;
    for (const TaskId id : members) groups.insert(tasks_.set[id].group);
    Deployment d;
    d.name = "chain-first";
    d.description = concat("callback groups of ", name, " on a separate thread above all others");
    const ThreadPolicy above{ThreadPolicy::Class::fifo, kChainPriority};
    d.executors.push_back({"chain", std::string(kBaselineExecutor), above, {}, 0});
    d.executors.push_back({"rest", std::string(kBaselineExecutor), {}, {}, 0});
    for (const Task& task : tasks_.set.tasks) d.executor_of.push_back(groups.contains(task.group) ? 0 : 1);
    if (std::ranges::count(d.executor_of, 1U) > 0) add(setup::deploy(std::move(d), scheduling_));
  }

  /// Priorities rise along the data flow from the sources, so that started work is finished first (PiCAS).
  void add_chain_threads(const ChainIndex& chain, const std::set<TaskId>& members, const std::string& name) {
    const auto next = [&](TaskId id) {
      std::vector<TaskId> along = tasks_.downstream(id);
      std::erase_if(along, [&](TaskId other) { return !members.contains(other); });
      return along;
    };
    Deployment d = find_deployment("cie", graph_, tasks_);
    d.name = "cie:chain";
    d.description = concat("CallbackIsolatedExecutor, threads of ", name, " above all others");
    int priority = kChainPriority;
    for (const TaskId id : reached_from(chain.sources, next)) {
      ThreadPolicy& policy = d.executors[d.executor_of[id]].policy;
      if (policy.ordinary()) policy = {ThreadPolicy::Class::fifo, std::min(kMostPriority, priority++)};
    }
    add(setup::deploy(std::move(d), scheduling_));
  }

  const Graph& graph_;
  const GraphTasks tasks_;
  const Options& options_;
  const SchedulerOptions scheduling_;
  bool several_processes_ = false;
  const setup::ExecutorSpec now_;
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
                                       const Options& options) {
  return Candidates(graph, options).made(objective);
}

Candidate with_graph(Candidate c, Graph graph) {
  c.graph = std::move(graph);
  c.tasks = make_tasks(c.graph);
  c.load = setup::utilisation(c.graph, c.tasks, &c.spec);
  return c;
}

Question::Question(const Options& given)
    : options(given),
      graph(graph_of(given)),
      tasks(make_tasks(graph)),
      objective(
          parse_objective(given.objective, graph, given.choose_phases ? results::kWorst : results::kP99)),
      folder(setup::output_folder(given.output, graph.name)) {
  std::vector<std::string> notes = setup::utilisation(graph, tasks, nullptr).warnings;
  if (!objective.note.empty()) notes.insert(notes.begin(), objective.note);
  for (const std::string& sentence : notes) std::cerr << "note: " << sentence << "\n";
}

std::vector<Candidate> Question::candidates_to_compare() const {
  program::check_output_folder(folder);
  return make_candidates(graph, objective, options);
}

const Candidate& Question::current(const std::vector<Candidate>& candidates) const {
  // A deployment from a file has the name in the file, and is the last candidate.
  const auto named = std::ranges::find(candidates, options.now, &Candidate::name);
  return named == candidates.end() ? candidates.back() : *named;
}

void Question::finish(const nlohmann::json& content) const {
  std::cout << "\nResults: " << folder.string() << "\n" << std::flush;
  program::show_json(content);
}

}  // namespace hotpath::advise
