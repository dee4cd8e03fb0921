// SPDX-License-Identifier: Apache-2.0
#include "import/chain_follower.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "import/recorded_window.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Samples that threads have taken, but whose jobs have not started.
constexpr std::size_t kTaken = 64;
/// Of a subscription that keeps all.
constexpr std::size_t kKeepAll = 1000;

/// Most chains of a graph without chains of the user.
constexpr std::size_t kChainsFound = 5;

/// The rules of a recorded graph; what enters messages is inferred.
ChainFollower::Rules rules_of(const tracing::System& system, const RecordedGraph& graph) {
  const auto tasks_of = [&](const std::vector<std::uint32_t>& callbacks) {
    std::vector<TaskId> tasks;
    tasks.reserve(callbacks.size());
    for (const std::uint32_t callback : callbacks) tasks.push_back(graph.task({callback, 0}));
    return tasks;
  };
  ChainFollower::Rules rules{.chains = index_chains(graph.graph, graph.tasks),
                             .unread = std::vector<std::size_t>(system.topics.size(), 0),
                             .lanes = ChainLanes(graph.graph, graph.tasks)};
  for (const InferredRule& rule : graph.rules)
    rules.held.push_back({rule.topic, tasks_of(rule.publishers), tasks_of(rule.of)});
  for (const tracing::Callback& reader : system.callbacks) {  // also services and clients
    if (reader.topic >= rules.unread.size()) continue;
    std::size_t& unread = rules.unread[reader.topic];
    unread = std::max(unread, ChainFollower::most_unread(reader.depth));
  }
  for (const Callback& callback : graph.tasks.callbacks)
    rules.publishing.push_back(!callback.publishes.empty());
  return rules;
}

/// The task that a name on the command line means: a task, or a node's timer or only callback.
TaskId named_task(const Graph& graph, const GraphTasks& tasks, const std::string& name, bool timer) {
  std::vector<TaskId> named = tasks_named(graph, tasks, name);
  if (named.size() > 1)
    std::erase_if(named, [&](TaskId id) { return (tasks.set[id].kind == TaskKind::timer) != timer; });
  if (named.size() == 1) return named.front();
  throw program::UsageError(program::concat(
      "--chain: ", name,
      named.empty() ? " is not a node or task of the graph" : " has several such callbacks; name one",
      "; the tasks are in graph.yaml, for example ", tasks.set[0].name));
}

}  // namespace

ChainFollower::ChainFollower(Rules rules, Observed observed)
    : rules_(std::move(rules)), observed_(std::move(observed)), history_(rules_.lanes) {
  for (const HeldInputs& rule : rules_.held) held_.emplace_back(rule.of.size());
}

std::size_t ChainFollower::most_unread(std::uint32_t depth) {
  return std::min<std::size_t>(depth == 0 ? kKeepAll : depth, kKeepAll) + kTaken;
}

void ChainFollower::start(const tracing::JobRef& job, JobRef as, Time at, const std::optional<Taken>& taken) {
  Running& running = running_[key_of(job)];
  running.ref = as;
  running.start = at;
  if (taken) running.own = message_of(*taken);
  if (!running.own) return;
  for (std::size_t r = 0; r < held_.size(); ++r) {
    const std::vector<TaskId>& of = rules_.held[r].of;
    const auto slot = std::ranges::find(of, as.task);
    if (slot != of.end()) held_[r][static_cast<std::size_t>(slot - of.begin())] = running.own;
  }
}

ChainFollower::Message ChainFollower::message_of(const Taken& taken) const {
  const auto published = messages_.find({taken.by, taken.topic});
  if (published == messages_.end()) return nullptr;
  const auto& latest = published->second;
  const auto message = std::find_if(latest.rbegin(), latest.rend(),
                                    [&](const auto& m) { return m.first == key_of(taken.job); });
  return message == latest.rend() ? nullptr : message->second;
}

void ChainFollower::publish(const tracing::JobRef& job, std::uint32_t topic) {
  const auto open = running_.find(key_of(job));
  if (open == running_.end()) return;
  Running& running = open->second;
  auto message = std::make_shared<SimulatedMessage>();
  for (std::size_t r = 0; r < held_.size(); ++r) {
    const HeldInputs& rule = rules_.held[r];
    if (rule.topic != topic || std::ranges::count(rule.publishers, running.ref.task) == 0) continue;
    for (Message& held : held_[r]) {
      if (held) history_.merge(*message, *held, running.ref.task);
      held.reset();
    }
  }
  if (running.own) history_.merge(*message, *running.own, running.ref.task);
  history_.append(*message, {running.ref.task, 0, running.ref.sequence, running.start}, 0);
  observe(*message, running);
  if (topic >= rules_.unread.size()) return;
  auto& latest = messages_[{running.ref.task, topic}];
  if (!latest.empty() && latest.back().first == key_of(job)) latest.pop_back();
  latest.emplace_back(key_of(job), std::move(message));
  if (latest.size() > rules_.unread[topic]) latest.pop_front();
}

std::optional<JobRef> ChainFollower::end(const tracing::JobRef& job, bool ended) {
  const auto running = running_.find(key_of(job));
  if (running == running_.end()) return std::nullopt;
  const JobRef ref = running->second.ref;
  if (ended && !rules_.publishing[ref.task] && running->second.own)
    observe(*running->second.own, running->second);
  running_.erase(running);
  return ref;
}

void ChainFollower::observe(const SimulatedMessage& message, Running& running) {
  std::vector<std::uint32_t> ends;
  for (std::uint32_t c = 0; c < rules_.chains.size(); ++c)
    if (rules_.chains[c].ends_in(running.ref.task)) ends.push_back(c);
  observe_chains(history_, message, rules_.chains, ends, running, observed_);
}

std::vector<ChainObservation> recorded_chains(const tracing::System& system, const RecordedGraph& graph,
                                              const RecordedWindow& window) {
  std::vector<ChainObservation> observations;
  ChainFollower follower(rules_of(system, graph),
                         [&](const ChainObservation& o) { observations.push_back(o); });
  // What to do at which event of the trace, in its order.
  std::vector<std::pair<std::uint64_t, std::function<void()>>> steps;
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const tracing::Job& job = window.jobs[i];
    if (graph.task(job.ref) == kNoTask) continue;
    steps.emplace_back(job.started, [&, i] {
      std::optional<ChainFollower::Taken> taken;
      if (job.has_sample)
        taken = {job.sample.parent, graph.task(job.sample.parent), system.callbacks[job.ref.callback].topic};
      follower.start(job.ref, window.records[i].job.ref(), job.start, taken);
    });
    for (const tracing::Publication& p : job.published)
      steps.emplace_back(p.event, [&] { follower.publish(job.ref, p.topic); });
    if (job.ended) steps.emplace_back(job.finished, [&] { follower.end(job.ref, true); });
  }
  std::ranges::stable_sort(steps, {}, [](const auto& step) { return step.first; });
  for (const auto& [event, step] : steps) step();
  return observations;
}

/// Data that a callback only stores leaves its node with the messages whose rules take it.
static bool carries_data(const Graph& graph, const GraphTasks& tasks, const Chain& chain) {
  std::vector<TaskId> path;
  for (const std::string& name : chain.nodes) path.push_back(tasks_named(graph, tasks, name).front());
  for (std::size_t i = 2; i < path.size(); ++i) {
    const TaskOrigin &from = tasks.origin[path[i - 2]], &by = tasks.origin[path[i - 1]],
                     &to = tasks.origin[path[i]];
    const bool stored = from.input && std::ranges::count(tasks.set[path[i - 2]].feeds, path[i - 1]) == 0;
    if (from.node != by.node || to.node == by.node || !stored) continue;
    const std::string& topic = graph.nodes[to.node].inputs[*to.input].topic;
    for (const Publication& p : tasks.callbacks[path[i - 1]].publishes)
      if (p.topic == topic && std::ranges::count(p.of, *from.input) == 0) return false;
  }
  return true;
}

std::vector<Chain> recorded_chains_of(const Graph& graph, const GraphTasks& tasks) {
  std::vector<Chain> chains = find_chains(graph, tasks, std::numeric_limits<std::size_t>::max());
  std::erase_if(chains, [&](const Chain& chain) {
    return !carries_data(graph, tasks, chain) ||
           std::ranges::all_of(chain.sources, [](const std::string& source) {
             return source == kOutside || source.starts_with(std::string(kOutside) + "/");
           });
  });
  chains.resize(std::min(chains.size(), kChainsFound));
  for (std::size_t i = 0; i < chains.size(); ++i) chains[i].name = program::concat("chain_", i + 1);
  return chains;
}

Chain chain_of(const std::string& text, const Graph& graph, const GraphTasks& tasks) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos) throw program::UsageError("--chain: `" + text + "` is not SOURCE,...:SINK");
  Chain chain;
  chain.name = text.substr(colon + 1);
  const TaskId sink = named_task(graph, tasks, chain.name, false);
  std::ranges::replace(chain.name, '/', '.');  // names are written into CSV columns
  const auto next = [&](TaskId id) { return id == sink ? std::vector<TaskId>() : tasks.downstream(id); };
  const auto leads_to_sink = [&](TaskId id) {
    return std::ranges::count(reached_from({id}, next), sink) > 0;
  };
  std::vector<TaskId> sources;
  std::istringstream names(text.substr(0, colon));
  for (std::string name; std::getline(names, name, ',');) {
    const TaskId source = named_task(graph, tasks, name, true);
    if (tasks.set[source].kind != TaskKind::timer)
      throw program::UsageError("--chain: " + name + " is not a timer, and chains begin at timers");
    if (!leads_to_sink(source))
      throw program::UsageError("--chain: no data flows from " + name + " to " + chain.name);
    chain.sources.push_back(tasks.set[source].name);
    sources.push_back(source);
  }
  const std::vector<TaskId> reached = reached_from(sources, next);
  for (const TaskId id : std::set(reached.begin(), reached.end()))
    if (leads_to_sink(id)) chain.nodes.push_back(tasks.set[id].name);
  chain.sink = tasks.set[sink].name;
  return chain;
}

}  // namespace hotpath::imports
