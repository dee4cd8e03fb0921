// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "graph_source.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

using TaskLists = std::vector<std::vector<TaskId>>;

class Check {
 public:
  explicit Check(GraphSource& source) : source_(source), graph_(source.graph) {}

  void run() {
    node_names();
    publishers();
    inputs();
    deliveries();
    tasks_ = make_tasks(graph_);
    cycles();
    if (!graph_.has_callbacks()) histories();
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      if (node_of(id).type == NodeType::callbacks) names_.push_back(tasks_.set[id].name);
    }
    for (std::size_t c = 0; c < graph_.chains.size(); ++c) {
      complete(graph_.chains[c], source_.chains[c]);
      chain(c);
    }
  }

 private:
  [[noreturn]] void fail(int line, const std::string& problem, const std::string& remedy) const {
    throw InputError(source_.file, line, problem, remedy);
  }

  void node_names() {
    names_ = graph_.node_names();
    for (std::size_t n = 0; n < names_.size(); ++n) {
      const auto first = static_cast<std::size_t>(std::ranges::find(names_, names_[n]) - names_.begin());
      if (first == n) continue;
      fail(source_.nodes[n].node, "there are two nodes with the name " + names_[n],
           "rename this node or the node in line " + std::to_string(source_.nodes[first].node));
    }
  }

  void publishers() {
    std::unordered_map<std::string, std::size_t> publisher;
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      const Node& node = graph_.nodes[n];
      for (std::size_t o = 0; o < node.outputs.size(); ++o) {
        const std::string& topic = node.outputs[o];
        const auto [first, is_new] = publisher.emplace(topic, n);
        if (is_new) {
          topics_.push_back(topic);
          continue;
        }
        const auto rule = source_.rules.find(topic);
        if (rule != source_.rules.end() && rule->second.many_publishers) continue;
        fail(source_.nodes[n].outputs[o],
             "node " + node.name + " publishes topic " + topic + ", as node " +
                 graph_.nodes[first->second].name + " does (line " +
                 std::to_string(source_.nodes[first->second].node) + ")",
             "publish another topic, or allow several publishers with `topics: {" + topic +
                 ": {publishers: many}}`");
      }
    }
    for (const auto& [topic, rule] : source_.rules) {
      if (!publisher.contains(topic)) {
        fail(rule.line, "no node publishes topic " + topic + " of `topics`", suggest(topic, topics_));
      }
    }
  }

  void inputs() {
    const std::set<std::string> published(topics_.begin(), topics_.end());
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      std::set<std::string> seen;
      for (std::size_t i = 0; i < graph_.nodes[n].inputs.size(); ++i) {
        const std::string& topic = graph_.nodes[n].inputs[i].topic;
        const int line = source_.nodes[n].inputs[i];
        if (!published.contains(topic)) {
          const auto best = nearest(topic, topics_);
          fail(line,
               "node " + graph_.nodes[n].name + " subscribes to topic " + topic + ", which no node publishes",
               best ? "did you mean `" + *best + "`?" : "add a node with `output: " + topic + "`");
        }
        if (!seen.insert(topic).second) {
          fail(line, "node " + graph_.nodes[n].name + " subscribes to topic " + topic + " twice",
               "name each topic once among the inputs of a node");
        }
      }
    }
  }

  void deliveries() const {
    for (const auto& [topic, order] : graph_.delivery) {
      if (order.unknown()) continue;
      const std::string subject = "`delivery` of topic " + topic;
      const int line = source_.rules.at(topic).delivery_line;
      std::vector<std::string> left = subscribers_of(graph_, topic);  // not yet listed
      for (const std::string& node : order.nodes) {
        if (std::erase(left, node) > 0) continue;
        const std::string listed = std::string(subject).append(" lists node ").append(node);
        if (std::ranges::count(order.nodes, node) > 1)
          fail(line, listed + " twice", "list each subscriber once");
        fail(line, listed + ", which does not subscribe to it", suggest(node, left));
      }
      if (!left.empty())
        fail(line, subject + " lacks subscriber " + left.front(),
             "list all subscribers, first reached first");
    }
  }

  /// Finds subscriptions that activate each other for ever. Repeatedly removing all tasks without
  /// an upstream task leaves the tasks that are in a cycle or downstream of one.
  void cycles() const {
    const TaskId count = tasks_.set.size();
    TaskLists upstream(count);
    for (TaskId id = 0; id < count; ++id) {
      for (const TaskId fed : tasks_.set[id].feeds) upstream[fed].push_back(id);
    }
    std::vector<bool> left(count, true);
    const auto is_left = [&](TaskId id) { return left[id]; };
    for (bool changed = true; std::exchange(changed, false);) {
      for (TaskId id = 0; id < count; ++id) {
        if (!left[id] || std::ranges::any_of(upstream[id], is_left)) continue;
        left[id] = false;
        changed = true;
      }
    }
    const auto first = std::ranges::find(left, true);
    if (first == left.end()) return;

    // Each remaining task has a remaining upstream task, so walking upstream ends in the cycle.
    std::vector<TaskId> walk;
    auto id = static_cast<TaskId>(first - left.begin());
    while (std::ranges::find(walk, id) == walk.end()) {
      walk.push_back(id);
      id = *std::ranges::find_if(upstream[id], is_left);
    }
    walk.erase(walk.begin(), std::ranges::find(walk, id));
    std::ranges::reverse(walk);
    std::rotate(walk.begin(), std::ranges::min_element(walk), walk.end());
    std::string path;
    for (const TaskId step : walk) path += node_of(step).name + " -> ";
    const TaskOrigin& origin = tasks_.origin[walk.front()];
    fail(source_.nodes[origin.node].inputs[*origin.input],
         "the nodes " + path + node_of(walk.front()).name + " form a cycle without a timer",
         "cut it at a cyclic node, or take this input from another topic");
  }

  /// Bounds the entries of each message: its own entry, and those of all messages that its job
  /// merges.
  void histories() const {
    const TaskId count = tasks_.set.size();
    std::vector<std::set<std::uint32_t>> nodes(count);  // nodes that a message at this input can have visited
    std::vector<std::size_t> entries(count, 0);  // largest number of entries of one message at this input
    for (bool changed = true; changed;) {
      changed = false;
      for (TaskId id = 0; id < count; ++id) {
        if (tasks_.callbacks[id].publishes.empty()) continue;
        const TaskOrigin& origin = tasks_.origin[id];
        std::set<std::uint32_t> merged;
        std::size_t sum = 0;
        for (const TaskId input : tasks_.merged_inputs(id)) {
          merged.insert(nodes[input].begin(), nodes[input].end());
          sum += entries[input];
        }
        // With several publishers of one topic, `merged` overestimates any one message; with
        // fusions of one origin, `sum` does.
        const std::size_t most = std::min(sum, merged.size()) + 1;
        merged.insert(origin.node);
        if (most > kMaxHistory) {
          const Node& node = graph_.nodes[origin.node];
          fail(source_.nodes[origin.node].node,
               "messages of node " + node.name + " carry the statistics of " + std::to_string(most) +
                   " nodes or more",
               "a message has room for " + std::to_string(kMaxHistory) +
                   ": shorten the graph before this node");
        }
        for (const TaskId fed : tasks_.set[id].feeds) {
          const std::size_t before = nodes[fed].size() + entries[fed];
          nodes[fed].insert(merged.begin(), merged.end());
          entries[fed] = std::max(entries[fed], most);
          changed = changed || nodes[fed].size() + entries[fed] != before;
        }
      }
    }
  }

  /// Without `sink`, a chain ends in the node that feeds no other one of it; without `sources`, it begins
  /// in those that no other one feeds.
  void complete(Chain& chain, ChainLines& lines) const {
    if (!chain.sources.empty() && !chain.sink.empty()) return;
    const std::string subject = "chain " + chain.name;
    std::map<TaskId, std::string> members;
    for (std::size_t i = 0; i < chain.nodes.size(); ++i)
      for (const TaskId id : tasks_of(chain.nodes[i], subject, lines.nodes[i]))
        members.emplace(id, chain.nodes[i]);
    std::vector<std::string> first = chain.nodes, last = chain.nodes;
    for (const auto& [id, name] : members) {
      for (const TaskId next : tasks_.downstream(id)) {
        const auto to = members.find(next);
        if (to == members.end() || to->second == name) continue;
        std::erase(last, name);
        std::erase(first, to->second);
      }
    }
    check_gap(chain, first, members, lines);
    if (chain.sink.empty() && last.size() != 1)
      fail(lines.chain,
           subject + " has no `sink`, and ends in " + (last.empty() ? "a cycle" : joined(last, " and ")),
           "add `sink: " + (last.empty() ? chain.nodes : last).front() + "`, or another node");
    if (chain.sources.empty() && first.empty())
      fail(lines.chain, subject + " has no `sources`, and begins in a cycle",
           "add `sources: [" + chain.nodes.front() + "]`, or other nodes");
    if (chain.sink.empty()) chain.sink = last.front();
    if (!chain.sources.empty()) return;
    chain.sources = first;
    lines.sources.assign(first.size(), lines.chain);
  }

  /// Refuses the first node but one that no other node of the chain feeds, unless data begins there.
  void check_gap(const Chain& chain, const std::vector<std::string>& first,
                 const std::map<TaskId, std::string>& members, const ChainLines& lines) const {
    for (std::size_t i = 1; i < chain.nodes.size(); ++i) {
      const std::string &before = chain.nodes[i - 1], &name = chain.nodes[i];
      const auto begins = [&](const auto& member) {
        const Task& task = tasks_.set[member.first];
        return member.second == name && (task.kind == TaskKind::timer || task.name == name);
      };
      if (std::ranges::count(first, name) == 0 || std::ranges::any_of(members, begins)) continue;
      fail(lines.nodes[i],
           "chain " + chain.name + " has a gap before " + name + ": none of its nodes feeds it",
           "list the nodes from " + before + " to " + name + ", or what else feeds it");
    }
  }

  void chain(std::size_t c) {
    const Chain& chain = graph_.chains[c];
    const ChainLines& lines = source_.chains[c];
    const std::string subject = "chain " + chain.name;
    for (std::size_t other = 0; other < c; ++other) {
      if (graph_.chains[other].name == chain.name)
        fail(lines.chain, "there are two chains " + chain.name, "rename one");
    }
    std::set<TaskId> members;
    for (std::size_t i = 0; i < chain.nodes.size(); ++i) {
      for (const TaskId id : tasks_of(chain.nodes[i], subject, lines.nodes[i])) {
        if (members.insert(id).second) continue;
        fail(lines.nodes[i], subject + " lists node " + chain.nodes[i] + " twice", "list each node once");
      }
    }
    const auto require_member = [&](const std::string& name, int line) {
      std::vector<TaskId> named = tasks_of(name, subject, line);
      if (std::ranges::find(chain.nodes, name) == chain.nodes.end())
        fail(line, "node " + name + " is missing in `nodes` of " + subject, "list it there");
      return named;
    };
    const std::vector<TaskId> sink = require_member(chain.sink, lines.sink);
    if (std::ranges::all_of(sink, [&](TaskId id) { return tasks_.callbacks[id].stores_only; })) {
      fail(lines.sink,
           "sink " + chain.sink + " of " + subject + " only stores its samples for other callbacks",
           "name the node, or the task that publishes them");
    }
    if (chain.sources.size() > kMaxSources) {
      fail(lines.sources[kMaxSources], subject + " has " + std::to_string(chain.sources.size()) + " sources",
           "list at most " + std::to_string(kMaxSources));
    }
    for (std::size_t i = 0; i < chain.sources.size(); ++i) {
      const int line = lines.sources[i];
      const std::string source = std::string("source ").append(chain.sources[i]);
      const TaskId start = start_of(require_member(chain.sources[i], line), chain.sources[i], subject, line);
      const std::vector<TaskId> reached = reached_from(start, members);
      if (std::ranges::find_first_of(reached, sink) == reached.end()) {
        fail(line,
             std::string("sink ").append(chain.sink).append(" of ").append(subject) +
                 " cannot be reached from " + source + " along its nodes: they end at " +
                 node_of(reached.back()).name,
             "list all nodes between them in `nodes`, or choose another sink");
      }
      if (tasks_.downstream(start).size() > tasks_.set[start].feeds.size()) {
        fail(line,
             std::string(source).append(" of ").append(subject) +
                 " stores samples for messages that name only the job that publishes them",
             "begin with the node that publishes its topic");
      }
    }
  }

  std::vector<TaskId> tasks_of(const std::string& name, const std::string& chain, int line) const {
    std::vector<TaskId> named = tasks_named(graph_, tasks_, name);
    if (named.empty()) fail(line, chain + " visits unknown node " + name, suggest(name, names_));
    return named;
  }

  /// The task where the data of a chain begins: the only timer, or the named task.
  TaskId start_of(std::vector<TaskId> tasks, const std::string& source, const std::string& chain,
                  int line) const {
    if (tasks.size() == 1 && source == tasks_.set[tasks.front()].name) return tasks.front();
    std::erase_if(tasks, [&](TaskId id) { return tasks_.set[id].kind != TaskKind::timer; });
    if (tasks.empty()) {
      fail(line, "source " + source + " of " + chain + " has no timer",
           "data begins at a sensor or a cyclic node");
    }
    if (tasks.size() > 1) {
      fail(line, "source " + source + " of " + chain + " has " + std::to_string(tasks.size()) + " timers",
           "name the task in which data begins, such as " + tasks_.set[tasks.front()].name +
               ", as a source and among `nodes`");
    }
    return tasks.front();
  }

  /// The members to which data flows from the member `from` through members only, itself first.
  std::vector<TaskId> reached_from(TaskId from, std::set<TaskId> members) const {
    std::vector<TaskId> reached = {from};
    members.erase(from);
    for (std::size_t i = 0; i < reached.size(); ++i) {
      for (const TaskId next : tasks_.downstream(reached[i]))
        if (members.erase(next) > 0) reached.push_back(next);
    }
    return reached;
  }

  const Node& node_of(TaskId id) const { return graph_.nodes[tasks_.origin[id].node]; }

  GraphSource& source_;
  Graph& graph_;
  GraphTasks tasks_;
  std::vector<std::string> names_, topics_;
};

}  // namespace

void check_graph(GraphSource& source) { Check(source).run(); }

}  // namespace hotpath
