// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <algorithm>
#include <cctype>
#include <limits>
#include <map>
#include <set>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/find_chains.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "hotpath/reference_system/ros_names.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Most chains of a graph without chains of the user.
constexpr std::size_t kChainsFound = 5;

/// The first of NAME, NAME_2, NAME_3, ... that is not used yet.
std::string unused_name(const std::string& name, std::set<std::string>& used) {
  std::string unused = name;
  for (int i = 2; !used.insert(unused).second; ++i) unused = program::concat(name, "_", i);
  return unused;
}

std::string graph_name(const std::string& ros_name, bool is_node) {
  const std::string name = is_node ? graph_node_name(ros_name) : graph_topic_name(ros_name);
  return name.empty() ? "unnamed" : name;
}

class Builder {
 public:
  Builder(const tracing::System& system, std::span<const tracing::Job> jobs,
          const std::vector<std::uint32_t>& executor_of, const std::string& name, ServiceOrder order)
      : system_(system), jobs_(jobs), executor_of_(executor_of), order_(std::move(order)) {
    result_.graph.name = printable(graph_name(name, true), kMaxNameBytes);
    if (!order_.nodes.empty()) return;
    for (std::uint32_t n = 0; n < system.nodes.size(); ++n) order_.nodes.push_back(n);
    for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) order_.callbacks.push_back(c);
  }

  RecordedGraph build() {
    name_nodes();
    choose_tasks();
    result_.rules = infer_rules(system_, jobs_, is_task_);
    drop_silent_inputs();
    name_topics();
    find_overlaps();
    for (const std::uint32_t n : order_.nodes) add_node(n);
    add_outside();
    if (result_.graph.nodes.empty())
      throw program::UsageError("the trace has no timer and no subscription for a graph; record for longer");
    cut_cycles();
    index_tasks();
    return std::move(result_);
  }

 private:
  void note(const auto&... parts) { result_.notes.push_back(program::concat(parts...)); }
  const tracing::Callback& callback(std::uint32_t c) const { return system_.callbacks[c]; }
  const std::string& topic_of(std::uint32_t c) const { return system_.topics[callback(c).topic].name; }
  static bool is_beside_topics(tracing::CallbackKind kind) {
    using K = tracing::CallbackKind;
    return kind == K::service || kind == K::client || kind == K::unannounced;
  }
  /// The topic in the graph: a node has one input for each, so that further ones read a copy.
  const std::string& input_name(std::uint32_t c) const {
    return result_.topic_names[callback(c).topic][copy_of_[c] - 1];
  }

  void name_nodes() {
    std::set<std::string> used = {kOutside};
    for (const std::string& node : system_.nodes) {
      const std::string plain = graph_name(node, true);
      result_.node_names.push_back(unused_name(plain, used));
      if (result_.node_names.back() != plain)
        note("The graph has another node ", plain, "; node ", node, " is called ", result_.node_names.back(),
             " in it.");
    }
  }

  /// Names the topics of the graph. They keep their names before services and copies of topics.
  void name_topics() {
    std::set<std::uint32_t> in_graph;
    for (const InferredRule& rule : result_.rules)
      if (!is_housekeeping(system_.topics[rule.topic].name)) in_graph.insert(rule.topic);
    for (std::uint32_t c = 0; c < is_task_.size(); ++c)
      if (is_task_[c] && callback(c).topic != kNone) in_graph.insert(callback(c).topic);
    std::set<std::uint32_t> of_services;
    for (const tracing::Callback& c : system_.callbacks)
      if (is_beside_topics(c.kind)) of_services.insert(c.topic);
    std::vector<std::uint32_t> order(in_graph.begin(), in_graph.end());
    std::ranges::stable_sort(order, {}, [&](std::uint32_t t) { return of_services.contains(t); });
    std::set<std::string> used;
    result_.topic_names.resize(system_.topics.size());
    for (const std::uint32_t t : order) {
      const std::string& recorded = system_.topics[t].name;
      const std::string plain = graph_name(recorded, false);
      result_.topic_names[t].push_back(unused_name(plain, used));
      if (result_.topic_names[t].front() != plain)
        note("The graph has another topic ", plain, "; ", recorded, " is called ",
             result_.topic_names[t].front(), " in it.");
    }
    for (std::uint32_t c = 0; c < is_task_.size(); ++c) {
      if (!is_task_[c] || callback(c).topic == kNone) continue;
      std::vector<std::string>& names = result_.topic_names[callback(c).topic];
      while (names.size() < copy_of_[c])
        names.push_back(unused_name(program::concat(names.front(), "_", names.size() + 1), used));
      if (copy_of_[c] == 1) continue;
      note("Node ", result_.node_names[callback(c).node], " subscribes to ", topic_of(c), " several times; ",
           input_name(c), " is a copy of the topic in the graph, published with it.");
    }
  }

  void choose_tasks() {
    is_task_.assign(system_.callbacks.size(), false);
    std::uint64_t unknown = 0, jobs_of_unknown = 0, elsewhere = 0, jobs_elsewhere = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> subscribed;  // by node and topic
    copy_of_.assign(system_.callbacks.size(), 1);
    for (std::uint32_t c = 0; c < system_.callbacks.size(); ++c) {
      const tracing::Callback& recorded = callback(c);
      std::uint32_t& same = subscribed[{recorded.node, recorded.topic}];
      if (recorded.kind == tracing::CallbackKind::unknown ||
          (!is_beside_topics(recorded.kind) && recorded.node == kNone)) {
        ++unknown;
        jobs_of_unknown += recorded.jobs;
        continue;
      }
      if (is_beside_topics(recorded.kind)) {
        if (recorded.node == kNone || recorded.jobs == 0) continue;
        if (executor_of_[c] != kNone) {
          is_task_[c] = std::exchange(same, std::max(same, 1U)) == 0;
        } else {
          ++elsewhere;
          jobs_elsewhere += recorded.jobs;
        }
        continue;
      }
      if (recorded.kind == tracing::CallbackKind::subscription) {
        if (is_housekeeping(topic_of(c))) continue;
        copy_of_[c] = ++same;
      }
      is_task_[c] = true;
    }
    if (elsewhere > 0)
      note(elsewhere, " callbacks of services and clients with ", jobs_elsewhere,
           " jobs ran on threads without timers and subscriptions and are left out.");
    if (unknown > 0)
      note(unknown, " callbacks with ", jobs_of_unknown,
           " jobs have no initialisation event in the trace and are left out; start the recording before the "
           "nodes.");
    if (std::ranges::count(is_task_, true) == 0) {
      throw program::UsageError(
          jobs_of_unknown > 0
              ? "the trace has callbacks but no initialisation events (ros2:rcl_node_init and others), so "
                "that their nodes are unknown; start the recording before the nodes, and keep all events "
                "`ros2:*`"
              : "the trace has no callback of a node; record user-space events `ros2:*` while the nodes "
                "start and run");
    }
  }

  /// Drops subscriptions without samples.
  void drop_silent_inputs() {
    for (const InferredRule& rule : result_.rules) published_.insert(rule.topic);
    for (std::uint32_t c = 0; c < is_task_.size(); ++c) {
      if (!is_task_[c] || callback(c).kind == tracing::CallbackKind::timer ||
          published_.contains(callback(c).topic))
        continue;
      if (callback(c).jobs > 0) {
        outside_.insert(callback(c).topic);
        continue;
      }
      is_task_[c] = false;
      note("Nobody published ", topic_of(c), ", to which node ", result_.node_names[callback(c).node],
           " subscribes; the subscription is left out.");
    }
    for (InferredRule& rule : result_.rules)
      std::erase_if(rule.of, [&](std::uint32_t c) { return !is_task_[c]; });
  }

  /// Finds callbacks of one node that overlapped: they cannot share a mutually exclusive group.
  void find_overlaps() {
    overlaps_.assign(system_.callbacks.size(), false);
    reentrant_.assign(system_.callbacks.size(), false);
    std::map<std::uint32_t, std::vector<const tracing::Job*>> open;  // by node
    for (const tracing::Job& job : jobs_) {
      const std::uint32_t c = job.ref.callback;
      if (!job.ended || c >= is_task_.size() || !is_task_[c]) continue;
      auto& others = open[callback(c).node];
      std::erase_if(others, [&](const tracing::Job* o) { return o->finish <= job.start; });
      for (const tracing::Job* other : others) {
        if (other->thread == job.thread) continue;
        overlaps_[c] = overlaps_[other->ref.callback] = true;
        if (other->ref.callback == c) reentrant_[c] = true;
      }
      others.push_back(&job);
    }
  }

  void add_node(std::uint32_t n) {
    Node node;
    node.name = result_.node_names[n];
    std::vector<std::uint32_t> own, timers;
    for (const std::uint32_t c : order_.callbacks)
      if (is_task_[c] && callback(c).node == n) own.push_back(c);
    if (own.empty()) return;
    std::map<std::uint32_t, std::uint32_t> input_of;  // by callback
    std::set<std::string> used;
    for (const std::uint32_t c : own) {
      if (callback(c).kind == tracing::CallbackKind::timer) {
        timers.push_back(c);
        continue;
      }
      input_of[c] = static_cast<std::uint32_t>(node.inputs.size());
      node.inputs.push_back({input_name(c), std::max(1U, callback(c).depth)});
      used.insert(input_name(c));
    }
    std::map<std::string, std::uint32_t> groups;
    for (const std::uint32_t c : own) {
      Callback added;
      const auto input = input_of.find(c);
      std::string name = "timer";
      if (input != input_of.end()) {
        added.input = input->second;
        name = node.inputs[input->second].topic;
      } else {
        if (timers.size() > 1)
          name += program::concat("_", 1 + (std::ranges::find(timers, c) - timers.begin()));
        name = unused_name(name, used);
        added.phase = Duration::zero();
      }
      added.service = callback(c).kind == tracing::CallbackKind::service;
      added.task = program::concat(node.name, "/", name);
      added.period = added.deadline = callback(c).period;
      add_publications(c, input_of, node, added);
      group(c, node, groups, added);
      result_.callback_of.push_back(c);
      node.callbacks.push_back(std::move(added));
    }
    if (node.group_names == std::vector<std::string>{"default"}) node.group_names.clear();
    result_.graph.nodes.push_back(std::move(node));
  }

  void add_publications(std::uint32_t c, const std::map<std::uint32_t, std::uint32_t>& input_of, Node& node,
                        Callback& publisher) const {
    for (const InferredRule& rule : result_.rules) {
      if (is_housekeeping(system_.topics[rule.topic].name)) continue;
      const bool set = rule.rule == PublishRule::all_new;
      const std::vector<std::uint32_t>& publishers = set ? rule.of : rule.publishers;
      if (std::ranges::find(publishers, c) == publishers.end()) continue;
      Publication p;
      p.rule = rule.rule;
      p.n = rule.n;
      for (const std::uint32_t from : rule.of) p.of.push_back(input_of.at(from));
      std::ranges::sort(p.of);
      if (p.rule == PublishRule::last_of && p.of.empty()) p.rule = PublishRule::always;
      for (const std::string& name : result_.topic_names[rule.topic]) {
        p.topic = name;
        add_publication(p, node, publisher);
      }
    }
  }

  static void add_publication(const Publication& p, Node& node, Callback& publisher) {
    if (std::ranges::find(node.outputs, p.topic) == node.outputs.end()) node.outputs.push_back(p.topic);
    publisher.publishes.push_back(p);
  }

  /// Puts all callbacks of a node into one group, rclcpp's default, unless the trace contradicts.
  void group(std::uint32_t c, Node& node, std::map<std::string, std::uint32_t>& groups,
             Callback& member) const {
    std::set<std::uint32_t> executors;
    for (std::uint32_t other = 0; other < is_task_.size(); ++other)
      if (is_task_[other] && callback(other).node == callback(c).node && executor_of_[other] != kNone)
        executors.insert(executor_of_[other]);
    std::string key;
    if (executors.size() > 1)
      key = program::concat("e", executor_of_[c] == kNone ? *executors.begin() : executor_of_[c]);
    if (overlaps_[c]) key = program::concat("own_", member.task.substr(node.name.size() + 1));
    std::ranges::replace(key, '/', '.');
    const auto [at, is_new] = groups.try_emplace(key, static_cast<std::uint32_t>(node.groups.size()));
    member.group = at->second;
    if (!is_new) return;
    node.groups.push_back(reentrant_[c] ? CallbackGroup::reentrant : CallbackGroup::mutually_exclusive);
    node.group_names.push_back(key.empty() ? "default" : key);
  }

  /// Adds timers without work for each topic without a publisher.
  void add_outside() {
    if (outside_.empty()) return;
    Node node;
    node.name = kOutside;
    node.groups = {CallbackGroup::mutually_exclusive};
    std::set<std::string> used;
    const RecordedTime recorded{
        jobs_.front().start,
        std::ranges::max_element(jobs_, {}, &tracing::Job::finish)->finish};  // not empty: an input has jobs
    for (const std::uint32_t topic : outside_) {
      std::vector<Time> at;
      std::uint32_t reader = 0;
      while (!is_task_[reader] || callback(reader).topic != topic || callback(reader).jobs == 0) ++reader;
      for (const tracing::Job& job : jobs_)
        if (job.ref.callback == reader && job.has_sample) at.push_back(job.sample.published);
      if (at.empty()) at = {Time{}};
      std::ranges::sort(at);
      const OutsideReleases releases = outside_releases(at, recorded);
      const std::string name = graph_name(result_.topic_names[topic].front(), true);
      const bool several = releases.first.size() > 1;
      for (std::size_t i = 0; i < releases.first.size(); ++i) {
        Callback timer;
        timer.task = program::concat(node.name, "/",
                                     unused_name(several ? program::concat(name, "_", i + 1) : name, used));
        timer.period = timer.deadline = releases.period;
        timer.release_jitter = releases.jitter;
        timer.phase = releases.first[i] - Time{};
        for (const std::string& published : result_.topic_names[topic])
          add_publication({.topic = published, .of = {}}, node, timer);
        result_.callback_of.push_back(kNone);
        node.callbacks.push_back(std::move(timer));
      }
      const tracing::CallbackKind kind = callback(reader).kind;
      const auto [missing, come] =
          kind == tracing::CallbackKind::service
              ? std::pair("A trace does not show the requests to service ", "; in the graph they come from ")
          : is_beside_topics(kind)
              ? std::pair("A trace does not show what triggers the clients and waitables of ",
                          "; in the graph it is ")
              : std::pair("No callback of the trace publishes topic ", "; in the graph it comes from ");
      note(missing, system_.topics[topic].name, come, releases.timers, ".");
    }
    result_.graph.nodes.push_back(std::move(node));
  }

  /// A cycle of subscriptions without a timer cannot be simulated. Removes the publication to the
  /// subscription with the fewest jobs.
  void cut_cycles() {
    for (;;) {
      const GraphTasks tasks = make_tasks(result_.graph);
      std::vector<int> state(tasks.set.size(), 0);
      std::vector<TaskId> path, cycle;
      for (TaskId id = 0; id < tasks.set.size() && cycle.empty(); ++id) visit(tasks, id, state, path, cycle);
      if (cycle.empty()) return;
      const auto jobs_of = [&](TaskId id) { return callback(result_.callback_of[id]).jobs; };
      const TaskId to = *std::ranges::min_element(cycle, {}, jobs_of);
      const TaskOrigin& origin = tasks.origin[to];
      const std::string topic = result_.graph.nodes[origin.node].inputs[*origin.input].topic;
      const auto at = std::ranges::find(cycle, to) - cycle.begin();
      const TaskId from = cycle[(static_cast<std::size_t>(at) + cycle.size() - 1) % cycle.size()];
      std::erase_if(callback_of_task(result_.graph, tasks.origin[from]).publishes,
                    [&](const Publication& p) { return p.topic == topic; });
      note("Data flows in a cycle without a timer; ", tasks.set[from].name, " does not publish ", topic,
           " in the graph.");
    }
  }

  static void visit(const GraphTasks& tasks, TaskId id, std::vector<int>& state, std::vector<TaskId>& path,
                    std::vector<TaskId>& cycle) {
    if (state[id] == 2 || !cycle.empty()) return;
    if (state[id] == 1) {
      cycle.assign(std::ranges::find(path, id), path.end());
      return;
    }
    state[id] = 1;
    path.push_back(id);
    for (const TaskId next : tasks.set[id].feeds) visit(tasks, next, state, path, cycle);
    path.pop_back();
    state[id] = 2;
  }

  void index_tasks() {
    result_.tasks = make_tasks(result_.graph);
    result_.task_of.assign(system_.callbacks.size(), kNoTask);
    Time epoch = kNever;
    for (TaskId id = 0; id < result_.callback_of.size(); ++id) {
      const std::uint32_t c = result_.callback_of[id];
      if (c == kNone) continue;
      result_.task_of[c] = id;
      if (callback(c).kind == tracing::CallbackKind::timer) epoch = std::min(epoch, callback(c).created);
    }
    result_.epoch = epoch != kNever ? epoch : jobs_.empty() ? Time{} : jobs_.front().start;
  }

  const tracing::System& system_;
  const std::span<const tracing::Job> jobs_;
  const std::vector<std::uint32_t>& executor_of_;
  ServiceOrder order_;
  RecordedGraph result_;
  std::vector<bool> is_task_, overlaps_, reentrant_;  // by callback
  std::set<std::uint32_t> published_, outside_;       // topics
  std::vector<std::uint32_t> copy_of_;                // by callback: 1, or the number of the topic's copy
};

}  // namespace

bool is_housekeeping(const std::string& topic) { return topic == "/rosout" || topic == "/parameter_events"; }

std::vector<Chain> recorded_chains_of(const Graph& graph, const GraphTasks& tasks) {
  std::vector<Chain> chains = find_chains(graph, tasks, std::numeric_limits<std::size_t>::max());
  std::erase_if(chains, [](const Chain& chain) {
    return std::ranges::all_of(chain.sources, [](const std::string& source) {
      return source == kOutside || source.starts_with(std::string(kOutside) + "/");
    });
  });
  chains.resize(std::min(chains.size(), kChainsFound));
  for (std::size_t i = 0; i < chains.size(); ++i) chains[i].name = "chain_" + std::to_string(i + 1);
  return chains;
}

RecordedGraph make_recorded_graph(const tracing::System& system, std::span<const tracing::Job> jobs,
                                  const std::vector<std::uint32_t>& executor_of, const std::string& name,
                                  const ServiceOrder& order) {
  return Builder(system, jobs, executor_of, name, order).build();
}

}  // namespace hotpath::imports
