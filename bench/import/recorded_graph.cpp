// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/ros_names.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using program::concat;
using tracing::CallbackKind;

/// Bounds of a graph file: queues, and periods of timers, which would not be due in a recording.
constexpr std::uint32_t kDeepest = 1000;
constexpr Duration kLongest = std::chrono::hours(24);

/// The first of NAME, NAME_2, NAME_3, ... that is not used yet.
std::string unused_name(const std::string& name, std::set<std::string>& used) {
  std::string unused = name;
  for (int i = 2; !used.insert(unused).second; ++i) unused = concat(name, "_", i);
  return unused;
}

std::string graph_name(const std::string& ros_name, bool is_node) {
  const std::string name = is_node ? graph_node_name(ros_name) : graph_topic_name(ros_name);
  return name.empty() ? "unnamed" : name;
}

EntityKind entity_of(const tracing::Callback& callback) {
  if (callback.kind == CallbackKind::service) return EntityKind::service;
  if (callback.kind == CallbackKind::client) return EntityKind::client;
  if (callback.kind == CallbackKind::unannounced || callback.of_action) return EntityKind::waitable;
  return callback.intra_process ? EntityKind::intra_process : EntityKind::subscription;
}

bool is_beside_topics(CallbackKind kind) {
  return kind == CallbackKind::service || kind == CallbackKind::client || kind == CallbackKind::unannounced;
}

void add_publication(const Publication& p, Node& node, Callback& publisher) {
  if (std::ranges::count(node.outputs, p.topic) == 0) node.outputs.push_back(p.topic);
  publisher.publishes.push_back(p);
}

class Builder {
 public:
  Builder(const RecordedSystem& recorded, const std::string& name, const Shown& shown)
      : recorded_(recorded),
        shown_(shown),
        order_(shown.order),
        uses_(system_.callbacks.size()),
        is_task_(uses_.size(), false) {
    result_.remarks = recorded_.remarks;
    result_.graph.name = printable(graph_name(name, true), kMaxNameBytes);
    if (!order_.nodes.empty()) return;
    for (std::uint32_t n = 0; n < system_.nodes.size(); ++n) order_.nodes.push_back(n);
    for (std::uint32_t c = 0; c < uses_.size(); ++c) order_.callbacks.push_back(c);
  }

  RecordedGraph build() {
    std::set<std::string> used = {kOutside};
    for (const std::string& node : system_.nodes)
      result_.node_names.push_back(name_in_graph(node, true, used));
    choose_tasks();
    find_overlaps();
    result_.rules = infer_rules(system_, recorded_.jobs, is_task_, shown_.other);
    drop_silent_inputs();
    name_topics();
    find_undecided();
    for (const std::uint32_t n : order_.nodes) add_node(n);
    cut_cycles();
    add_outside();
    if (result_.graph.nodes.empty())
      throw program::UsageError("the trace has no timer and no subscription for a graph; record for longer");
    index_tasks();
    return std::move(result_);
  }

 private:
  /// What becomes of a callback.
  struct Use {
    std::uint32_t copy = 1;  ///< 1, or the number of its topic's copy.
    bool overlaps = false;   ///< It overlapped one of its node, with which it shares no exclusive group.
    bool overlaps_itself = false;
  };

  void remark(Remark kind, const auto&... parts) { result_.remarks[kind].push_back(concat(parts...)); }
  void leave_out(const auto&... parts) { remark(Remark::missing, parts...); }
  const tracing::Callback& callback(std::uint32_t c) const { return system_.callbacks[c]; }
  const std::string& topic_of(std::uint32_t c) const { return recorded_.topic_of(c); }
  bool reads(std::uint32_t c) const { return is_task_[c] && callback(c).topic != kNone; }
  /// The topic in the graph: a node has one input for each, so that further ones read a copy.
  const std::string& input_name(std::uint32_t c) const {
    return result_.topic_names[callback(c).topic][uses_[c].copy - 1];
  }

  std::string name_in_graph(const std::string& ros_name, bool is_node, std::set<std::string>& used) {
    const std::string plain = graph_name(ros_name, is_node);
    std::string name = unused_name(plain, used);
    const char* const kind = is_node ? "node " : "topic ";
    if (name != plain)
      remark(Remark::difference, "The graph has another ", kind, plain, "; ", kind, ros_name, " is called ",
             name, " in it.");
    return name;
  }

  void choose_tasks() {
    std::uint64_t unknown = 0, jobs_of_unknown = 0, elsewhere = 0, jobs_elsewhere = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> subscribed;  // by node and topic
    for (std::uint32_t c = 0; c < uses_.size(); ++c) {
      const auto& [kind, node, topic, jobs] =
          std::tie(callback(c).kind, callback(c).node, callback(c).topic, callback(c).jobs);
      std::uint32_t& same = subscribed[{node, topic}];
      if (kind == CallbackKind::unknown || (!is_beside_topics(kind) && node == kNone)) {
        ++unknown;
        jobs_of_unknown += jobs;
      } else if (const Duration period = callback(c).period;
                 kind == CallbackKind::timer && (period <= Duration{} || period > kLongest)) {
        leave_out("A timer of node ", system_.nodes[node], " has a period of ", to_ms(period),
                  " ms and is left out.");
      } else if (!is_beside_topics(kind)) {
        is_task_[c] = kind == CallbackKind::timer || !is_housekeeping(topic_of(c));
        if (kind == CallbackKind::subscription && is_task_[c]) uses_[c].copy = ++same;
      } else if (node != kNone && jobs > 0 && recorded_.executor_of[c] != kNone) {
        is_task_[c] = std::exchange(same, std::max(same, 1U)) == 0;
      } else if (node != kNone && jobs > 0) {
        ++elsewhere;
        jobs_elsewhere += jobs;
      }
    }
    if (elsewhere > 0)
      leave_out(elsewhere, " callbacks of services and clients with ", jobs_elsewhere,
                " jobs ran on threads without timers and subscriptions and are left out.");
    if (unknown > 0)
      leave_out(unknown, " callbacks with ", jobs_of_unknown,
                " jobs have no initialisation event and are left out; start the recording before the nodes.");
    if (std::ranges::count(is_task_, true) > 0) return;
    throw program::UsageError(
        jobs_of_unknown > 0
            ? "the trace has callbacks but no initialisation events (such as ros2:rcl_node_init); start the "
              "recording before the nodes, and keep all events `ros2:*`"
            : "the trace has no callback of a node; record `ros2:*` while the nodes start and run");
  }

  void find_overlaps() {
    std::map<std::uint32_t, std::vector<const tracing::Job*>> open;  // by node
    for (const tracing::Job& job : recorded_.jobs) {
      const std::uint32_t c = job.ref.callback;
      if (!job.ended || c >= uses_.size() || !is_task_[c]) continue;
      auto& others = open[callback(c).node];
      std::erase_if(others, [&](const tracing::Job* o) { return o->finish <= job.start; });
      for (const tracing::Job* other : others) {
        if (other->thread == job.thread) continue;
        uses_[c].overlaps = uses_[other->ref.callback].overlaps = true;
        if (other->ref.callback == c) uses_[c].overlaps_itself = true;
      }
      others.push_back(&job);
    }
  }

  /// Drops subscriptions without samples.
  void drop_silent_inputs() {
    std::set<std::uint32_t> published;
    for (const InferredRule& rule : result_.rules) published.insert(rule.topic);
    for (std::uint32_t c = 0; c < uses_.size(); ++c) {
      const bool is_sent = published.contains(callback(c).topic);
      if (!reads(c) || callback(c).jobs > 0 || (is_sent && !callback(c).of_action)) continue;
      is_task_[c] = false;
      leave_out(is_sent ? "No event shows jobs of " : "Nobody published ", topic_of(c), ", to which node ",
                result_.node_names[callback(c).node], " subscribes; the subscription is left out.");
    }
    for (InferredRule& rule : result_.rules)
      std::erase_if(rule.of, [&](std::uint32_t c) { return !is_task_[c]; });
  }

  /// Names the topics of the graph. They keep their names before services and copies of topics.
  void name_topics() {
    std::set<std::uint32_t> in_graph, of_services;
    for (const InferredRule& rule : result_.rules)
      if (!is_housekeeping(system_.topics[rule.topic].name)) in_graph.insert(rule.topic);
    for (std::uint32_t c = 0; c < uses_.size(); ++c) {
      if (reads(c)) in_graph.insert(callback(c).topic);
      if (is_beside_topics(callback(c).kind)) of_services.insert(callback(c).topic);
    }
    std::vector<std::uint32_t> order(in_graph.begin(), in_graph.end());
    std::ranges::stable_sort(order, {}, [&](std::uint32_t t) { return of_services.contains(t); });
    std::set<std::string> used;
    result_.topic_names.resize(system_.topics.size());
    for (const std::uint32_t t : order)
      result_.topic_names[t] = {name_in_graph(system_.topics[t].name, false, used)};
    for (std::uint32_t c = 0; c < uses_.size(); ++c) {
      if (!reads(c)) continue;
      std::vector<std::string>& names = result_.topic_names[callback(c).topic];
      while (names.size() < uses_[c].copy)
        names.push_back(unused_name(concat(names.front(), "_", names.size() + 1), used));
      if (uses_[c].copy > 1)
        remark(Remark::difference, "Node ", result_.node_names[callback(c).node], " subscribes to ",
               topic_of(c), " several times; ", input_name(c),
               " is a copy of the topic in the graph, published with it.");
    }
  }

  void find_undecided() {
    for (const InferredRule& rule : result_.rules)
      if (!rule.as_good.empty())
        remark(Remark::undecided, system_.topics[rule.topic].name, " is published ", rule_text(system_, rule),
               ", or ", rule_text(system_, rule.as_good.front()));
    std::set<std::uint32_t> nodes;
    for (std::uint32_t c = 0; c < uses_.size(); ++c)
      if (uses_[c].overlaps && !uses_[c].overlaps_itself && nodes.insert(callback(c).node).second)
        remark(Remark::undecided, "callbacks of node ", system_.nodes[callback(c).node],
               " that overlapped have groups of their own, or a reentrant one");
  }

  void add_node(std::uint32_t n) {
    std::vector<std::uint32_t> own;
    for (const std::uint32_t c : order_.callbacks)
      if (is_task_[c] && callback(c).node == n) own.push_back(c);
    if (own.empty()) return;
    Node& node = result_.graph.nodes.emplace_back();
    node.name = result_.node_names[n];
    std::map<std::uint32_t, std::uint32_t> input_of;  // by callback
    std::set<std::string> used;
    for (const std::uint32_t c : own) {
      if (callback(c).kind == CallbackKind::timer) continue;
      input_of[c] = static_cast<std::uint32_t>(node.inputs.size());
      node.inputs.push_back({input_name(c), std::clamp(callback(c).depth, 1U, kDeepest)});
      used.insert(input_name(c));
    }
    const bool several = input_of.size() + 1 < own.size();
    int timers = 0;
    for (const std::uint32_t c : own) {
      Callback added;
      std::string name;
      if (const auto input = input_of.find(c); input != input_of.end()) {
        added.input = input->second;
        name = input_name(c);
      } else {
        name = unused_name(several ? concat("timer_", ++timers) : "timer", used);
        added.phase = Duration::zero();
      }
      added.entity = entity_of(callback(c));
      added.task = concat(node.name, "/", name);
      added.period = added.deadline = callback(c).period;
      if (shown_.priorities.contains(c)) added.priority = shown_.priorities.at(c);
      add_publications(c, input_of, node, added);
      added.group = group_of(c, name, node);
      result_.callback_of.push_back(c);
      node.callbacks.push_back(std::move(added));
    }
    if (node.group_names == std::vector<std::string>{"default"}) node.group_names.clear();
  }

  void add_publications(std::uint32_t c, const std::map<std::uint32_t, std::uint32_t>& input_of, Node& node,
                        Callback& publisher) const {
    for (const InferredRule& rule : result_.rules) {
      if (is_housekeeping(system_.topics[rule.topic].name)) continue;
      const bool set = rule.rule == PublishRule::all_new;
      if (std::ranges::count(set ? rule.of : rule.publishers, c) == 0) continue;
      Publication p{.rule = rule.rule, .n = rule.n, .first = rule.first, .of = {}, .topic = {}};
      if (const auto early = early_.find({c, rule.topic}); early != early_.end()) p.at = early->second;
      for (const std::uint32_t from : rule.of) p.of.push_back(input_of.at(from));
      std::ranges::sort(p.of);
      if (p.rule == PublishRule::last_of && p.of.empty()) p.rule = PublishRule::always;
      for (const std::string& name : result_.topic_names[rule.topic]) {
        p.topic = name;
        add_publication(p, node, publisher);
      }
    }
  }

  /// All callbacks of a node have one group, rclcpp's default, unless the trace contradicts.
  std::uint32_t group_of(std::uint32_t c, const std::string& callback_name, Node& node) const {
    std::set<std::uint32_t> executors;
    for (std::uint32_t other = 0; other < uses_.size(); ++other)
      if (is_task_[other] && callback(other).node == callback(c).node)
        executors.insert(recorded_.executor_of[other]);
    executors.erase(kNone);
    std::string name = "default";
    if (executors.size() > 1)
      name = concat("e", recorded_.executor_of[c] == kNone ? *executors.begin() : recorded_.executor_of[c]);
    if (uses_[c].overlaps) name = "own_" + callback_name;
    std::ranges::replace(name, '/', '.');
    const auto at = std::ranges::find(node.group_names, name);
    const auto group = static_cast<std::uint32_t>(at - node.group_names.begin());
    if (at != node.group_names.end()) return group;
    using enum CallbackGroup;
    const bool several = uses_[c].overlaps_itself || (shown_.other && uses_[c].overlaps);
    node.groups.push_back(several ? reentrant : mutually_exclusive);
    node.group_names.push_back(name);
    return group;
  }

  /// Adds timers without work for each topic without a publisher.
  void add_outside() {
    std::set<std::string> published;
    std::set<std::uint32_t> topics_outside;
    for (const Node& node : result_.graph.nodes)
      for (const Callback& c : node.callbacks)
        for (const Publication& p : c.publishes) published.insert(p.topic);
    for (std::uint32_t c = 0; c < uses_.size(); ++c)
      if (reads(c) && !published.contains(input_name(c))) topics_outside.insert(callback(c).topic);
    if (topics_outside.empty()) return;
    const std::vector<tracing::Job>& jobs = recorded_.jobs;  // not empty: an input has jobs
    const Time end = std::ranges::max_element(jobs, {}, &tracing::Job::finish)->finish;
    Node& node = result_.graph.nodes.emplace_back();
    node.name = kOutside;
    node.groups = {CallbackGroup::mutually_exclusive};
    std::set<std::string> used;
    for (const std::uint32_t topic : topics_outside) {
      std::uint32_t reader = kNone;
      for (std::uint32_t c = 0; c < uses_.size(); ++c)
        if (reads(c) && callback(c).topic == topic && (reader == kNone || callback(reader).jobs == 0))
          reader = c;
      std::vector<Time> at;
      for (const tracing::Job& job : jobs)
        if (job.ref.callback == reader && job.has_sample) at.push_back(job.sample.published);
      if (at.empty()) at = {jobs.front().start};
      std::ranges::sort(at);
      const OutsideReleases releases = outside_releases(at, jobs.front().start, end);
      const std::vector<std::string>& topics = result_.topic_names[topic];
      const std::string name = graph_name(topics.front(), true);
      for (std::size_t i = 0; i < releases.first.size(); ++i) {
        Callback timer;
        const bool several = releases.first.size() > 1;
        timer.task = concat(node.name, "/", unused_name(several ? concat(name, "_", i + 1) : name, used));
        timer.period = timer.deadline = releases.period;
        timer.release_jitter = releases.jitter;
        timer.phase = releases.first[i] - Time{};
        for (const std::string& topic_name : topics)
          if (!published.contains(topic_name)) add_publication({.of = {}, .topic = topic_name}, node, timer);
        result_.callback_of.push_back(kNone);
        node.callbacks.push_back(std::move(timer));
      }
      const CallbackKind kind = callback(reader).kind;
      leave_out(kind == CallbackKind::service ? "A trace does not show the requests to service "
                : is_beside_topics(kind) ? "A trace does not show what triggers the clients and waitables of "
                                         : "No callback of the trace publishes topic ",
                system_.topics[topic].name, "; in the graph it comes from ", releases.timers, ".");
    }
  }

  /// A cycle without a timer cannot be simulated: its subscription with the fewest jobs gets nothing from it.
  void cut_cycles() {
    for (;;) {
      const GraphTasks tasks = make_tasks(result_.graph);
      std::vector<TaskId> cycle = tasks.cycle();
      if (cycle.empty()) return;
      const auto jobs_of = [&](TaskId id) { return callback(result_.callback_of[id]).jobs; };
      std::rotate(cycle.begin(), std::ranges::min_element(cycle, {}, jobs_of), cycle.end());
      const TaskOrigin& to = tasks.origin[cycle.front()];
      const std::string topic = result_.graph.nodes[to.node].inputs[*to.input].topic;
      std::erase_if(callback_of_task(result_.graph, tasks.origin[cycle.back()]).publishes,
                    [&](const Publication& p) { return p.topic == topic; });
      leave_out("Data flows in a cycle without a timer; ", tasks.set[cycle.back()].name, " does not publish ",
                topic, " in the graph.");
    }
  }

  void index_tasks() {
    result_.tasks = make_tasks(result_.graph);
    result_.task_of.assign(uses_.size(), kNoTask);
    Time epoch = kNever;
    for (TaskId id = 0; id < result_.callback_of.size(); ++id) {
      const std::uint32_t c = result_.callback_of[id];
      if (c == kNone) continue;
      result_.task_of[c] = id;
      if (callback(c).kind == CallbackKind::timer) epoch = std::min(epoch, callback(c).created);
    }
    result_.epoch = epoch != kNever ? epoch : recorded_.jobs.front().start;
  }

  const RecordedSystem& recorded_;
  const tracing::System& system_ = recorded_.system;
  const Shown& shown_;
  ServiceOrder order_;
  const EarlyPublications early_ = early_publications(recorded_.jobs);
  std::vector<Use> uses_;      // by callback
  std::vector<bool> is_task_;  // by callback
  RecordedGraph result_;
};

}  // namespace

RecordedGraph make_recorded_graph(const RecordedSystem& recorded, const std::string& name,
                                  const Shown& shown) {
  return Builder(recorded, name, shown).build();
}

}  // namespace hotpath::imports
