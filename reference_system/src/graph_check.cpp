// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>
#include <set>
#include <unordered_map>

#include "graph_source.hpp"
#include "graph_text.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

using TaskLists = std::vector<std::vector<TaskId>>;

class Check {
 public:
  explicit Check(const GraphSource& source) : source_(source), graph_(source.graph) {}

  void run() {
    node_names();
    publishers();
    inputs();
    tasks_ = make_tasks(graph_);
    cycles();
    histories();
    for (std::size_t c = 0; c < graph_.chains.size(); ++c) chain(c);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& problem, const std::string& remedy) const {
    throw InputError(source_.file, line, problem, remedy);
  }

  void node_names() {
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      const std::string& name = graph_.nodes[n].name;
      const auto [previous, is_new] = index_.emplace(name, n);
      if (!is_new) {
        fail(source_.nodes[n].node, "there are two nodes with the name " + name,
             "rename this one or that in line " + std::to_string(source_.nodes[previous->second].node));
      }
      names_.push_back(name);
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
             "give another `output`, or, if it is meant, allow it with `topics: {" + topic +
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
               "node " + graph_.nodes[n].name + " subscribes to topic " + topic + ", which nobody publishes",
               best ? "did you mean `" + *best + "`?" : "add a node with `output: " + topic + "`");
        }
        if (!seen.insert(topic).second) {
          fail(line, "node " + graph_.nodes[n].name + " subscribes to topic " + topic + " twice",
               "name each topic once among the inputs of a node");
        }
      }
    }
  }

  /// Subscriptions whose jobs lead to jobs of each other for ever. What is left when all tasks without an
  /// upstream task have been removed again and again is a cycle or lies behind one.
  void cycles() const {
    const TaskId count = tasks_.set.size();
    TaskLists upstream(count);
    std::vector<std::size_t> open(count);
    for (TaskId id = 0; id < count; ++id) {
      for (const TaskId fed : tasks_.set[id].feeds) upstream[fed].push_back(id);
    }
    std::vector<TaskId> free;
    for (TaskId id = 0; id < count; ++id) {
      open[id] = upstream[id].size();
      if (open[id] == 0) free.push_back(id);
    }
    std::size_t left = count;
    while (!free.empty()) {
      const TaskId id = free.back();
      free.pop_back();
      --left;
      for (const TaskId fed : tasks_.set[id].feeds) {
        if (--open[fed] == 0) free.push_back(fed);
      }
    }
    if (left == 0) return;

    // Each task that is left has an upstream task that is left: walking upstream ends in the cycle.
    const auto is_left = [&](TaskId id) { return open[id] > 0; };
    TaskId id = 0;
    while (!is_left(id)) ++id;
    std::vector<TaskId> walk;
    while (std::find(walk.begin(), walk.end(), id) == walk.end()) {
      walk.push_back(id);
      id = *std::find_if(upstream[id].begin(), upstream[id].end(), is_left);
    }
    walk.erase(walk.begin(), std::find(walk.begin(), walk.end(), id));
    std::reverse(walk.begin(), walk.end());
    std::rotate(walk.begin(), std::min_element(walk.begin(), walk.end()), walk.end());
    std::string path;
    for (const TaskId step : walk) path += node_of(step).name + " -> ";
    const TaskOrigin& origin = tasks_.origin[walk.front()];
    fail(source_.nodes[origin.node].inputs[*origin.input],
         "the nodes " + path + node_of(walk.front()).name + " form a cycle without a timer",
         "cut it at a cyclic node, or take this input from another topic");
  }

  /// Bounds the entries of each message: its own, and all that the messages carry that its job has merged.
  void histories() const {
    const TaskId count = tasks_.set.size();
    std::vector<std::set<std::uint32_t>> nodes(count);  // that a message at this input can have visited
    std::vector<std::size_t> entries(count, 0);         // most that one message at this input carries
    for (bool changed = true; changed;) {
      changed = false;
      for (TaskId id = 0; id < count; ++id) {
        if (!publishes(id)) continue;
        const TaskOrigin& origin = tasks_.origin[id];
        std::set<std::uint32_t> merged;
        std::size_t sum = 0;
        for (const TaskId input : merged_inputs(id)) {
          merged.insert(nodes[input].begin(), nodes[input].end());
          sum += entries[input];
        }
        // Several publishers of one topic make `merged` larger than any one message, fusions of one origin
        // `sum`.
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

  bool publishes(TaskId id) const {
    const NodeType type = node_of(id).type;
    return type != NodeType::command && !(type == NodeType::cyclic && tasks_.origin[id].input);
  }

  /// The subscriptions whose messages go into a message that a job of this task publishes.
  std::vector<TaskId> merged_inputs(TaskId id) const {
    const TaskOrigin& origin = tasks_.origin[id];
    const Node& node = graph_.nodes[origin.node];
    if (node.type == NodeType::intersection) return {id};
    const TaskId first = id - origin.input.value_or(static_cast<std::uint32_t>(node.inputs.size()));
    std::vector<TaskId> inputs(node.inputs.size());
    std::iota(inputs.begin(), inputs.end(), first);
    return inputs;
  }

  void chain(std::size_t c) {
    const Chain& chain = graph_.chains[c];
    const ChainLines& lines = source_.chains[c];
    const std::string what = "chain " + chain.name;
    for (std::size_t other = 0; other < c; ++other) {
      if (graph_.chains[other].name == chain.name)
        fail(lines.chain, "there are two chains " + chain.name, "rename one");
    }
    const auto require_known = [&](const std::string& name, int line) {
      if (!index_.contains(name)) fail(line, what + " visits unknown node " + name, suggest(name, names_));
    };
    std::set<std::string> members;
    for (std::size_t i = 0; i < chain.nodes.size(); ++i) {
      require_known(chain.nodes[i], lines.nodes[i]);
      if (!members.insert(chain.nodes[i]).second) {
        fail(lines.nodes[i], what + " lists node " + chain.nodes[i] + " twice", "list each node once");
      }
    }
    const auto require_member = [&](const std::string& name, int line) {
      require_known(name, line);
      if (!members.contains(name))
        fail(line, "node " + name + " is missing in `nodes` of " + what, "list it there");
    };
    require_member(chain.sink, lines.sink);
    for (std::size_t i = 0; i < chain.sources.size(); ++i) {
      require_member(chain.sources[i], lines.sources[i]);
      const Node& source = graph_.nodes[index_.at(chain.sources[i])];
      if (source.type != NodeType::sensor && source.type != NodeType::cyclic) {
        fail(lines.sources[i], "source " + source.name + " of " + what + " has no timer",
             "data begins at a sensor or a cyclic node");
      }
      if (!reaches(source.name, chain.sink, members)) {
        fail(lines.sources[i],
             "sink " + chain.sink + " of " + what + " cannot be reached from source " + source.name +
                 " along its nodes",
             "list all nodes between them in `nodes`, or choose another sink");
      }
    }
  }

  /// Whether data flows from a node's timer to another node by way of members only.
  bool reaches(const std::string& from, const std::string& to, const std::set<std::string>& members) const {
    std::vector<bool> seen(tasks_.set.size(), false);
    std::vector<TaskId> pending = {timer_of(index_.at(from))};
    while (!pending.empty()) {
      const TaskId id = pending.back();
      pending.pop_back();
      if (seen[id] || !members.contains(node_of(id).name)) continue;
      if (node_of(id).name == to) return true;
      seen[id] = true;
      const std::vector<TaskId>& feeds = tasks_.set[id].feeds;
      pending.insert(pending.end(), feeds.begin(), feeds.end());
      if (node_of(id).type == NodeType::cyclic) pending.push_back(timer_of(tasks_.origin[id].node));
    }
    return false;
  }

  const Node& node_of(TaskId id) const { return graph_.nodes[tasks_.origin[id].node]; }

  TaskId timer_of(std::size_t node) const {
    TaskId id = 0;
    while (tasks_.origin[id].node != node || tasks_.origin[id].input) ++id;
    return id;
  }

  const GraphSource& source_;
  const Graph& graph_;
  GraphTasks tasks_;
  std::unordered_map<std::string, std::size_t> index_;
  std::vector<std::string> names_, topics_;
};

}  // namespace

void check_graph(const GraphSource& source) { Check(source).run(); }

}  // namespace hotpath
