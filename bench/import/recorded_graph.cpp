// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "import/imported_graph.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// A service with fewer requests has no rate.
constexpr std::uint64_t kLeastRequests = 10;

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

  void name_nodes() {
    std::set<std::string> used;
    for (const std::string& node : system_.nodes) {
      const std::string plain = graph_name(node, true);
      std::string name = plain;
      for (int i = 2; !used.insert(name).second; ++i) name = program::concat(plain, "_", i);
      if (name != plain)
        note("There are several nodes ", node, "; one of them is called ", name, " in the graph.");
      result_.node_names.push_back(name);
    }
  }

  void choose_tasks() {
    is_task_.assign(system_.callbacks.size(), false);
    std::uint64_t unknown = 0, jobs_of_unknown = 0;
    std::set<std::pair<std::uint32_t, std::uint32_t>> subscribed;
    for (std::uint32_t c = 0; c < system_.callbacks.size(); ++c) {
      const tracing::Callback& recorded = callback(c);
      if (recorded.kind == tracing::CallbackKind::unknown ||
          (recorded.kind != tracing::CallbackKind::service && recorded.node == kNone)) {
        ++unknown;
        jobs_of_unknown += recorded.jobs;
        continue;
      }
      if (recorded.kind == tracing::CallbackKind::service) {
        is_task_[c] = recorded.node != kNone && recorded.jobs >= kLeastRequests &&
                      subscribed.emplace(recorded.node, recorded.topic).second;
        continue;
      }
      if (recorded.kind == tracing::CallbackKind::subscription) {
        if (is_housekeeping(topic_of(c))) continue;
        if (!subscribed.emplace(recorded.node, recorded.topic).second) {
          note("Node ", result_.node_names[recorded.node], " subscribes to ", topic_of(c),
               " twice; one of the two is left out.");
          continue;
        }
      }
      is_task_[c] = true;
    }
    if (unknown > 0) {
      note(unknown, " callbacks with ", jobs_of_unknown,
           " jobs have no initialisation event in the trace and are left out; "
           "start the recording before the nodes.");
    }
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
    node.type = NodeType::callbacks;
    node.group = {};
    std::vector<std::uint32_t> own;
    for (const std::uint32_t c : order_.callbacks)
      if (is_task_[c] && callback(c).node == n) own.push_back(c);
    if (own.empty()) return;
    std::map<std::uint32_t, std::uint32_t> input_of;  // by callback
    for (const std::uint32_t c : own) {
      if (callback(c).kind == tracing::CallbackKind::timer) continue;
      input_of[c] = static_cast<std::uint32_t>(node.inputs.size());
      node.inputs.push_back({graph_name(topic_of(c), false), std::max(1U, callback(c).depth), {}});
    }
    std::map<std::string, std::uint32_t> groups;
    for (const std::uint32_t c : own) {
      Callback added;
      const auto input = input_of.find(c);
      if (input != input_of.end()) added.input = input->second;
      added.task =
          program::concat(node.name, "/", added.input ? node.inputs[*added.input].topic : timer_name(c, own));
      added.period = added.deadline = callback(c).period;
      if (!added.input) added.phase = Duration::zero();
      add_publications(c, input_of, node, added);
      group(c, node, groups, added);
      result_.callback_of.push_back(c);
      node.callbacks.push_back(std::move(added));
    }
    if (node.group_names == std::vector<std::string>{"default"}) node.group_names.clear();
    result_.graph.nodes.push_back(std::move(node));
  }

  std::string timer_name(std::uint32_t timer, const std::vector<std::uint32_t>& own) const {
    std::vector<std::uint32_t> timers;
    for (const std::uint32_t c : own)
      if (callback(c).kind == tracing::CallbackKind::timer) timers.push_back(c);
    if (timers.size() == 1) return "timer";
    return program::concat("timer_", 1 + (std::ranges::find(timers, timer) - timers.begin()));
  }

  void add_publications(std::uint32_t c, const std::map<std::uint32_t, std::uint32_t>& input_of, Node& node,
                        Callback& publisher) const {
    for (const InferredRule& rule : result_.rules) {
      if (is_housekeeping(system_.topics[rule.topic].name)) continue;
      const bool set = rule.rule == PublishRule::all_new;
      const std::vector<std::uint32_t>& publishers = set ? rule.of : rule.publishers;
      if (std::ranges::find(publishers, c) == publishers.end()) continue;
      Publication p;
      p.topic = graph_name(system_.topics[rule.topic].name, false);
      p.rule = rule.rule;
      p.n = rule.n;
      for (const std::uint32_t from : rule.of) p.of.push_back(input_of.at(from));
      std::ranges::sort(p.of);
      if (p.rule == PublishRule::last_of && p.of.empty()) p.rule = PublishRule::always;
      if (std::ranges::find(node.outputs, p.topic) == node.outputs.end()) node.outputs.push_back(p.topic);
      publisher.publishes.push_back(std::move(p));
    }
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

  /// Adds a timer without work for each topic without a publisher, at the rate of its samples.
  void add_outside() {
    if (outside_.empty()) return;
    Node node;
    node.name = "outside";
    node.type = NodeType::callbacks;
    node.groups = {CallbackGroup::mutually_exclusive};
    for (const std::uint32_t topic : outside_) {
      std::vector<Time> at;
      std::uint32_t reader = 0;
      while (!is_task_[reader] || callback(reader).topic != topic || callback(reader).jobs == 0) ++reader;
      for (const tracing::Job& job : jobs_)
        if (job.ref.callback == reader && job.has_sample) at.push_back(job.sample.published);
      if (at.size() < 2) at = {Time{}, Time{} + std::chrono::hours(1)};
      std::ranges::sort(at);
      Callback timer;
      const std::string name = graph_name(system_.topics[topic].name, false);
      timer.task = program::concat(node.name, "/", graph_name(system_.topics[topic].name, true));
      timer.period = timer.deadline =
          std::max(Duration(1000), (at.back() - at.front()) / static_cast<std::int64_t>(at.size() - 1));
      timer.phase = at.front() - Time{};
      timer.publishes.emplace_back().topic = name;
      node.outputs.push_back(name);
      const bool service = callback(reader).kind == tracing::CallbackKind::service;
      note(service ? "A trace does not show the requests to service "
                   : "No callback of the trace publishes topic ",
           system_.topics[topic].name, "; a timer of ", program::fixed(to_ms(timer.period), 1),
           " ms without work ", service ? "sends them" : "publishes it", " in the graph.");
      result_.callback_of.push_back(kNone);
      node.callbacks.push_back(std::move(timer));
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
      Node& node = result_.graph.nodes[tasks.origin[from].node];
      std::erase_if(node.callbacks[tasks.origin[from].callback].publishes,
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
};

}  // namespace

bool is_housekeeping(const std::string& topic) { return topic == "/rosout" || topic == "/parameter_events"; }

RecordedGraph make_recorded_graph(const tracing::System& system, std::span<const tracing::Job> jobs,
                                  const std::vector<std::uint32_t>& executor_of, const std::string& name,
                                  const ServiceOrder& order) {
  return Builder(system, jobs, executor_of, name, order).build();
}

}  // namespace hotpath::imports
