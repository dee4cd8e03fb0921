// SPDX-License-Identifier: Apache-2.0
#include "watch/stated_contract.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_text.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "setup/deployed_system.hpp"
#include "setup/executor_spec.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

namespace {

/// Minimum distances are stated to the next, second and third next publication.
constexpr std::int64_t kDistances = 3;
/// Bounds assume that threads never wait; an idle machine lets them wait less than this in a second.
constexpr int kWait_ms = 1;
/// Of a job among the work of timer threads.
constexpr Duration kLongest = std::chrono::seconds(100);

class StatedContract {
 public:
  StatedContract(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor)
      : graph_(graph),
        tasks_(tasks),
        executor_(executor),
        plan_(executor.deployment ? &executor.deployment->plan : nullptr),
        threads_(setup::threads_of(graph, setup::parts(executor), plan_)),
        bounds_(setup::guarantees(graph, tasks, executor)),
        names_(names()) {}

  std::string text() const {
    YAML::Node contract;
    for (TaskId task = 0; task < tasks_.set.size(); ++task) contract["callbacks"].push_back(callback(task));
    if (!graph_.chains.empty()) contract["chains"] = chains();
    contract["threads"] = threads();
    return YAML::Dump(contract) + "\n";
  }

 private:
  /// The contract's entries without terms, by task.
  std::vector<CallbackContract> names() const {
    std::vector<CallbackContract> all;
    std::map<std::uint32_t, std::uint32_t> timers;  // by node
    for (TaskId task = 0; task < tasks_.set.size(); ++task) {
      const TaskOrigin& origin = tasks_.origin[task];
      const Node& node = graph_.nodes[origin.node];
      CallbackContract& callback = all.emplace_back();
      callback.node = node.name;
      if (origin.input) callback.topic = node.inputs[*origin.input].topic;
      callback.service = tasks_.callbacks[task].service;
      if (!origin.input) callback.timer = ++timers[origin.node];
    }
    return all;
  }

  YAML::Node callback(TaskId task) const {
    const CallbackContract& name = names_[task];
    YAML::Node stated;
    stated["node"] = name.node;
    if (!name.topic.empty()) stated[name.service ? "service" : "topic"] = name.topic;
    if (name.timer > 1) stated["timer"] = name.timer;
    const Task& of = tasks_.set[task];
    const Callback& callback = tasks_.callbacks[task];
    const bool measured = callback.measured != nullptr || !callback.quantiles.empty();
    if (const auto longest = longest_run(task)) {
      const Origin origin = *longest > of.wcet ? Origin::derived
                            : measured         ? Origin::measured
                                               : Origin::given;
      state(stated, Clause::budget, format_ms(*longest), origin);
    }
    if (of.kind == TaskKind::timer) {
      state(stated, Clause::period, format_ms(of.period), Origin::given);
    } else {
      state(stated, Clause::depth, of.depth, Origin::given);
      state_distances(stated, task);
      if (loses_nothing(task)) state(stated, Clause::lost, 0, Origin::derived);
    }
    if (const auto distance = longest_distance(task))
      state(stated, Clause::maximum_distance, format_ms(*distance), Origin::derived);
    stated["publishes"] = publications(task);
    // A job without work has a bound of 0 in a graph without costs; no live job keeps it.
    if (const auto bound = response(task); bound && *bound > Duration::zero())
      state(stated, Clause::response, format_ms(*bound), Origin::derived);
    return stated;
  }

  template <class Value>
  static void state(YAML::Node& subject, Clause clause, const Value& value, Origin origin) {
    YAML::Node term;
    term["value"] = value;
    term["from"] = to_string(origin);
    term.SetStyle(YAML::EmitterStyle::Flow);
    subject[to_string(clause)] = term;
  }

  void state_distances(YAML::Node& subject, TaskId subscription) const {
    std::vector<std::string> distances;
    for (std::int64_t k = 1; k <= kDistances; ++k)
      distances.push_back(format_ms(shortest_distance(subscription, k)));
    if (distances.back() != "0") state(subject, Clause::minimum_distance, distances, Origin::derived);
  }

  YAML::Node publications(TaskId task) const {
    YAML::Node all = flow_list();
    for (const Publication& p : tasks_.callbacks[task].publishes) {
      YAML::Node publication;
      publication["topic"] = p.topic;
      for (const std::uint32_t input : p.of)
        publication["with"].push_back(graph_.nodes[tasks_.origin[task].node].inputs[input].topic);
      all.push_back(publication);
    }
    return all;
  }

  static YAML::Node flow_list() {
    YAML::Node list(YAML::NodeType::Sequence);
    list.SetStyle(YAML::EmitterStyle::Flow);
    return list;
  }

  YAML::Node chains() const {
    YAML::Node all;
    const std::vector<ChainIndex> indices = index_chains(graph_, tasks_);
    for (std::size_t c = 0; c < indices.size(); ++c) {
      const std::string& name = graph_.chains[c].name;
      YAML::Node stated;
      stated["name"] = name;
      stated["sources"] = names_of(indices[c].sources);
      stated["sinks"] = names_of(indices[c].sink_tasks);
      const bounds::ChainGuarantee* const bound = bounds_ ? bounds_->chain(name) : nullptr;
      if (bound && bound->hot_path)
        state(stated, Clause::hot_path, format_ms(Duration(bound->hot_path->ns)), Origin::derived);
      if (bound && bound->age)
        state(stated, Clause::age, format_ms(Duration(bound->age->ns)), Origin::derived);
      all.push_back(stated);
    }
    return all;
  }

  YAML::Node names_of(const std::vector<TaskId>& tasks) const {
    YAML::Node names = flow_list();
    for (const TaskId task : tasks) names.push_back(names_[task].name());
    return names;
  }

  YAML::Node threads() const {
    YAML::Node all(YAML::NodeType::Sequence);
    for (std::size_t e = 0; e < threads_.size(); ++e) {
      std::vector<TaskId> served;
      for (TaskId task = 0; task < tasks_.set.size(); ++task)
        if (executor_of(task) == e) served.push_back(task);
      if (served.empty()) continue;
      const DeployedExecutor* const plan = plan_ ? &plan_->executors[e] : nullptr;
      YAML::Node stated;
      stated["name"] = plan ? plan->name : executor_.label;
      stated["callbacks"] = names_of(served);
      if (plan) state(stated, Clause::policy, to_string(plan->policy), Origin::given);
      if (plan && !plan->processors.empty())
        state(stated, Clause::processors, plan->processors, Origin::given);
      // Others of the contract may let them wait for any time.
      if (rivals_of(e, false) == Rivals::none) state(stated, Clause::wait, kWait_ms, Origin::given);
      all.push_back(stated);
    }
    return all;
  }

  /// Most time from start to end of a job, without the jobs of other threads that displace it. Where events
  /// do not tell all that displaces it, it is that of the response, if that is bounded.
  std::optional<Duration> longest_run(TaskId task) const {
    const Duration wcet = tasks_.set[task].wcet;
    if (wcet == Duration::zero()) return std::nullopt;
    if (rivals_of(executor_of(task), timer_thread_runs(task)) == Rivals::untold) return response(task);
    return have_room(true) ? wcet : longest_run_below_timer_threads(task);
  }

  /// The same where timer threads displace the job: they release timers, and may run them.
  std::optional<Duration> longest_run_below_timer_threads(TaskId task) const {
    const Duration wcet = tasks_.set[task].wcet, late = release_lateness();
    const bool first = threads_.size() == 1 && timer_thread_runs(task);
    if (first || release_costs() == Duration::zero()) return wcet;
    if (has_real_time_threads()) return response(task);  // how long their jobs displace it is unknown
    for (Duration window = wcet;;) {                     // to its end, with the jobs of timer threads
      Duration run = wcet, jobs{};
      for (TaskId timer = 0; timer < tasks_.set.size(); ++timer) {
        const Task& of = tasks_.set[timer];
        if (of.kind != TaskKind::timer) continue;
        const std::int64_t releases = (window + late + of.release_jitter) / of.period + 1;
        run += releases * release_cost(timer);
        if (timer_thread_runs(timer)) jobs += releases * of.wcet;
      }
      if (run + jobs == window) return run;
      if (run + jobs > kLongest) return response(task);
      window = run + jobs;
    }
  }

  std::size_t executor_of(TaskId task) const { return plan_ ? plan_->executor_of[task] : 0; }

  bool timer_thread_runs(TaskId task) const {
    return tasks_.set[task].kind == TaskKind::timer && runs_timers(threads_[executor_of(task)]);
  }

  static bool runs_timers(const DeployedThread& t) {
    return t.executor->traits.timers == TimerHandling::release_and_execute;
  }

  /// Threads of an executor besides its timer thread.
  static std::uint32_t threads_without_timers(const DeployedThread& t) {
    return worker_count(*t.executor, t.scheduling) -
           (t.executor->traits.timers == TimerHandling::polled ? 0 : 1);
  }

  /// Work of the timer thread before a timer's job, or its release.
  Duration release_cost(TaskId timer) const {
    const GraphPlatform& p = graph_.platform;
    return p.release_cost + p.pass_cost + (timer_thread_runs(timer) ? p.timer_dispatch_cost : Duration{});
  }

  /// Of all timers.
  Duration release_costs() const {
    Duration all{};
    for (TaskId id = 0; id < tasks_.set.size(); ++id)
      if (tasks_.set[id].kind == TaskKind::timer) all += release_cost(id);
    return all;
  }

  bool has_real_time_threads() const {
    return threads_.size() > 1 &&
           std::ranges::any_of(threads_, [](const DeployedThread& t) { return t.priority > 0; });
  }

  /// Most time from a timer's timestamp until its timer thread, idle before, has the processor: one that is
  /// not raised waits for the end of a time slice.
  Duration release_lateness() const {
    const Duration all = release_costs(), slice = Platform{}.time_slice;
    const bool raised =
        std::ranges::all_of(threads_, [](const DeployedThread& t) { return t.timers_priority > t.priority; });
    return graph_.platform.wake_up + (raised ? Duration{} : all + slice * (1 + all / slice));
  }

  /// Whether each thread that runs jobs, or each thread at all, has a processor whenever it can run.
  bool have_room(bool at_all) const {
    std::uint32_t count = 0;
    for (const DeployedThread& t : threads_) {
      if (t.processors.size() < graph_.platform.cores) return false;
      const std::uint32_t jobs = threads_without_timers(t) + (runs_timers(t) ? 1 : 0);
      count += at_all ? worker_count(*t.executor, t.scheduling) : jobs;
    }
    return count <= graph_.platform.cores;
  }

  /// What keeps a processor from threads that run jobs. Equal real-time threads: only jobs that started
  /// before. Told by events: only jobs that start on the only processor of both.
  enum class Rivals : std::uint8_t { none, equal, told, untold };
  Rivals rivals_of(std::size_t executor, bool timers) const {
    const GraphPlatform& p = graph_.platform;
    const Duration costs =
        p.timer_dispatch_cost + p.subscription_dispatch_cost + p.wait_cost + p.wait_cost_per_entity;
    const DeployedThread& mine = threads_[executor];
    const int priority = timers ? mine.timers_priority : mine.priority;
    Rivals all = Rivals::none;
    const auto add = [&](std::uint32_t count, int other, bool told) {
      if (count > 0 && other == priority) all = std::max(all, other > 0 ? Rivals::equal : Rivals::untold);
      if (count > 0 && other > priority) all = std::max(all, told ? Rivals::told : Rivals::untold);
    };
    for (std::size_t e = 0; e < threads_.size() && !have_room(false); ++e) {
      const DeployedThread& t = threads_[e];
      if (std::ranges::find_first_of(t.processors, mine.processors) == t.processors.end()) continue;
      const bool one = t.processors.size() == 1 && mine.processors.size() == 1, own = e == executor;
      add(threads_without_timers(t) - (own && !timers ? 1 : 0), t.priority, one && costs == Duration::zero());
      add(runs_timers(t) && !(own && timers) ? 1 : 0, t.timers_priority, one);
    }
    return all;
  }

  std::optional<Duration> response(TaskId task) const {
    if (!bounds_ || !bounds_->tasks[task]) return std::nullopt;
    return Duration(bounds_->tasks[task]->ns);
  }

  /// The only task that publishes the samples of a subscription, if its response is bounded.
  std::optional<TaskId> publisher_of(TaskId subscription) const {
    std::vector<TaskId> publishers;
    for (TaskId task = 0; task < tasks_.set.size(); ++task) {
      const std::vector<TaskId>& feeds = tasks_.set[task].feeds;
      if (std::ranges::find(feeds, subscription) != feeds.end()) publishers.push_back(task);
    }
    if (publishers.size() != 1 || !response(publishers.front())) return std::nullopt;
    return publishers.front();
  }

  /// Least time from a sample of a subscription to the k-th next, 0 if none is known. The only task
  /// that publishes them does so from its timestamp to its response bound.
  Duration shortest_distance(TaskId subscription, std::int64_t k) const {
    const auto publisher = publisher_of(subscription);
    if (!publisher) return Duration::zero();
    const Task& of = tasks_.set[*publisher];
    const Duration before = of.kind == TaskKind::timer ? k * of.period : shortest_distance(*publisher, k);
    return std::max(Duration::zero(), before - *response(*publisher));
  }

  /// Whether every sample is taken before as many as the queue holds follow it.
  bool loses_nothing(TaskId subscription) const {
    const auto bound = response(subscription);
    return bound && shortest_distance(subscription, tasks_.set[subscription].depth) >= *bound;
  }

  /// Most time between two starts of a timer's jobs, or between two publications for a subscription.
  std::optional<Duration> longest_distance(TaskId task) const {
    const Task& of = tasks_.set[task];
    if (of.kind == TaskKind::timer) {
      const auto bound = response(task);
      return bound && *bound <= of.period ? std::optional(of.period + *bound) : std::nullopt;
    }
    const auto publisher = publisher_of(task);
    if (!publisher) return std::nullopt;
    const std::vector<Publication>& publishes = tasks_.callbacks[*publisher].publishes;
    const auto always = std::ranges::find(publishes, names_[task].topic, &Publication::topic);
    if (always == publishes.end() || always->rule != PublishRule::always) return std::nullopt;
    if (tasks_.set[*publisher].kind == TaskKind::timer) return longest_distance(*publisher);
    const auto before = loses_nothing(*publisher) ? longest_distance(*publisher) : std::nullopt;
    return before ? std::optional(*before + *response(*publisher)) : std::nullopt;
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const setup::ExecutorSpec& executor_;
  const Deployment* const plan_;               // nullptr: one executor
  const std::vector<DeployedThread> threads_;  // by executor
  const std::optional<bounds::Guarantees> bounds_;
  const std::vector<CallbackContract> names_;  // by task
};

}  // namespace

std::string stated_contract(const Graph& graph, const GraphTasks& tasks,
                            const setup::ExecutorSpec& executor) {
  return StatedContract(graph, tasks, executor).text();
}

std::string stated_contract(const guarantees::AnalyzeOptions& options) {
  if (options.executors.size() + options.deployments.size() != 1) {
    throw program::UsageError(
        "--contract: a contract holds under one executor or deployment; name it, for example --executors "
        "rm-ro");
  }
  Graph graph = setup::graph_to_run(options);
  options.apply_to(graph.platform);
  const GraphTasks tasks = make_tasks(graph);
  const setup::ExecutorSpec executor = setup::executors_to_run(options, graph, tasks).front();
  return stated_contract(graph, tasks, executor);
}

}  // namespace hotpath::watch
