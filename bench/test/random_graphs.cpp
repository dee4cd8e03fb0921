// SPDX-License-Identifier: Apache-2.0
#include "random_graphs.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <set>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

namespace {

class Generator {
 public:
  explicit Generator(Random& random) : random_(random) {}

  Graph make() {
    graph_.name = "random";
    const std::int64_t sensors = draw(random_, 1, 5);
    for (std::int64_t i = 0; i < sensors; ++i) add(NodeType::sensor);
    const std::int64_t others = chance(random_, 15) ? 0 : draw(random_, 1, 8);
    sequences_ = chance(random_, 15);
    for (std::int64_t i = 0; i < others; ++i) add(sequences_ ? NodeType::transform : any_type());
    for (const ReferenceNode& node : nodes_) add_node(node);
    scale_to_load(graph_, static_cast<double>(draw(random_, 20, 97)));
    for (Node& node : graph_.nodes) {
      const std::int64_t percent = chance(random_, 50) ? 100 : draw(random_, 0, 100);
      for (Callback& c : node.callbacks) c.best = c.worst * percent / 100;
    }
    if (chance(random_, 40)) add_costs();
    add_chains();
    return std::move(graph_);
  }

 private:
  NodeType any_type() {
    const std::int64_t d = draw(random_, 1, 100);
    return d <= 42   ? NodeType::transform
           : d <= 65 ? NodeType::fusion
           : d <= 80 ? NodeType::cyclic
           : d <= 90 ? NodeType::intersection
                     : NodeType::command;
  }

  void add(NodeType type) {
    ReferenceNode node;
    node.type = type;
    node.name = "N" + std::to_string(nodes_.size());
    if (type == NodeType::sensor || type == NodeType::cyclic) {
      constexpr std::array kPeriods = {10, 20, 25, 30, 40, 50, 50, 60, 80, 100, 100, 120, 200};
      node.period = node.deadline =
          kPeriods[static_cast<std::size_t>(draw(random_, 0, kPeriods.size() - 1))] * 1ms;
      if (chance(random_, 25)) node.deadline = node.period * draw(random_, 50, 150) / 100;
      if (!chance(random_, 5)) node.priority = draw(random_, 0, 5);
    }
    node.execution_time = draw(random_, nodes_.empty() ? 1 : 0, 10) * 1ms;
    std::size_t inputs = type == NodeType::sensor                                   ? 0
                         : type == NodeType::transform || type == NodeType::command ? 1
                                                                                    : draw(random_, 2, 3);
    std::vector<std::string> free = topics_;
    if (sequences_) std::erase_if(free, [&](const std::string& topic) { return read_.contains(topic); });
    std::shuffle(free.begin(), free.end(), random_);
    inputs = std::min(inputs, free.size());
    for (std::size_t i = 0; i < inputs; ++i) add_input(node, free[i]);
    const std::size_t outputs = type == NodeType::intersection ? inputs : type == NodeType::command ? 0 : 1;
    for (std::size_t i = 0; i < outputs; ++i) add_output(node);
    nodes_.push_back(std::move(node));
  }

  void add_input(ReferenceNode& node, const std::string& topic) {
    ReferenceInput input;
    input.topic = topic;
    input.depth = chance(random_, 60) ? 1 : static_cast<std::uint32_t>(draw(random_, 2, 5));
    if (chance(random_, 12)) input.priority = draw(random_, 0, 5);
    node.inputs.push_back(std::move(input));
    read_.insert(topic);
  }

  /// Sometimes reuses another node's topic, if it has no subscriber yet, so that no cycle arises.
  void add_output(ReferenceNode& node) {
    std::vector<std::string> shared;
    for (const std::string& topic : topics_) {
      if (!read_.contains(topic) && std::ranges::find(node.outputs, topic) == node.outputs.end())
        shared.push_back(topic);
    }
    if (!shared.empty() && !sequences_ && chance(random_, 25)) {
      node.outputs.push_back(shared[static_cast<std::size_t>(draw(random_, 0, shared.size() - 1))]);
      return;
    }
    node.outputs.push_back("t" + std::to_string(topics_.size()));
    topics_.push_back(node.outputs.back());
  }

  /// Some fusions become callbacks, each with its own execution time.
  void add_node(ReferenceNode node) {
    const bool of_callbacks = node.type == NodeType::fusion && chance(random_, 30);
    const bool too_few_topics = node.type == NodeType::fusion && node.inputs.size() == 1;
    if (too_few_topics && !of_callbacks) node.type = NodeType::transform;
    Node& added = graph_.nodes.emplace_back(node);
    if (!of_callbacks) return;
    added.type = NodeType::callbacks;
    for (Callback& callback : added.callbacks) callback.worst = draw(random_, 0, 10) * 1ms;
  }

  void add_costs() {
    for (const PlatformCost& cost : kPlatformCosts) {
      if (chance(random_, 40)) cost.set(graph_.platform, draw(random_, 1, 400) * 1us);
    }
    graph_.platform.wait_cost_per_entity /= 100;
    if (!chance(random_, 30)) graph_.platform.delivery_delay = {};
    if (chance(random_, 30)) graph_.platform.cores = 2;
    if (chance(random_, 30)) graph_.platform.timer_thread = TimerThread::equal;
  }

  /// Adds chains from the timers upstream of a node to that node.
  void add_chains() {
    const GraphTasks tasks = make_tasks(graph_);
    for (std::uint32_t n = 0; n < graph_.nodes.size(); ++n) {
      const Node& sink = graph_.nodes[n];
      if (sink.type == NodeType::sensor || chance(random_, 40)) continue;
      Chain chain;
      chain.name = "to" + sink.name;
      chain.sink = sink.name;
      for (TaskId id = 0; id < tasks.set.size(); ++id) {
        const Node& source = graph_.nodes[tasks.origin[id].node];
        if (tasks.set[id].kind != TaskKind::timer || &source == &sink || !reaches(tasks, id, n)) continue;
        if (source.type == NodeType::sensor || chance(random_, 30)) chain.sources.push_back(source.name);
      }
      if (chain.sources.empty()) continue;
      for (const Node& node : graph_.nodes) chain.nodes.push_back(node.name);
      graph_.chains.push_back(std::move(chain));
    }
  }

  static bool reaches(const GraphTasks& tasks, TaskId from, std::uint32_t node) {
    const auto reached = reached_from({from}, [&](TaskId id) { return tasks.downstream(id); });
    return std::ranges::any_of(reached, [&](TaskId id) { return tasks.origin[id].node == node; });
  }

  Random& random_;
  std::vector<ReferenceNode> nodes_;
  Graph graph_;
  std::vector<std::string> topics_;
  std::set<std::string> read_;
  bool sequences_ = false;
};

}  // namespace

std::int64_t draw(Random& random, std::int64_t least, std::int64_t most) {
  return std::uniform_int_distribution<std::int64_t>(least, most)(random);
}

bool chance(Random& random, int percent) { return draw(random, 1, 100) <= percent; }

Graph random_graph(Random& random) { return Generator(random).make(); }

}  // namespace hotpath::test
