// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

namespace hotpath {

namespace {

bool has_timer(const Node& node) { return node.type == NodeType::sensor || node.type == NodeType::cyclic; }

Task timer_task(const Node& node, std::uint32_t group) {
  Task task;
  task.name = node.name;
  task.kind = TaskKind::timer;
  task.period = node.period;
  task.phase = node.phase.value_or(Duration::zero());
  task.deadline = node.deadline > Duration::zero() ? node.deadline : node.period;
  task.wcet = node.execution_time;
  task.bcet = node.best_case_execution_time;
  task.priority = node.priority;
  task.group = group;
  return task;
}

Task subscription_task(const Node& node, const Input& input, std::uint32_t group) {
  Task task;
  task.name = node.name + "/" + input.topic;
  task.kind = TaskKind::subscription;
  task.priority = input.priority;
  task.depth = input.depth;
  task.group = group;
  if (node.type != NodeType::cyclic) {  // whose subscriptions only store the sample
    task.wcet = node.execution_time;
    task.bcet = node.best_case_execution_time;
  }
  return task;
}

/// The topic that jobs of a task publish to; nullptr for none.
const std::string* published_topic(const Node& node, const TaskOrigin& origin) {
  switch (node.type) {
    case NodeType::command:
      return nullptr;
    case NodeType::intersection:
      return &node.outputs.at(*origin.input);
    case NodeType::cyclic:
      if (origin.input) return nullptr;
      break;
    case NodeType::sensor:
    case NodeType::transform:
    case NodeType::fusion:
      break;
  }
  return node.outputs.empty() ? nullptr : &node.outputs.front();
}

/// Rates by recursion from a task to the tasks that publish its topic.
class Rates {
 public:
  Rates(const Graph& graph, const GraphTasks& tasks)
      : graph_(graph), tasks_(tasks), publishers_(tasks.set.size()), rate_(tasks.set.size(), kUnknown) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      for (const TaskId fed : tasks.set[id].feeds) publishers_[fed].push_back(id);
    }
  }

  std::vector<double> all() {
    for (TaskId id = 0; id < tasks_.set.size(); ++id) rate(id);
    return std::move(rate_);
  }

 private:
  static constexpr double kUnknown = -1;

  double rate(TaskId id) {
    if (rate_[id] != kUnknown) return rate_[id];
    const Task& task = tasks_.set[id];
    const Node& node = graph_.nodes[tasks_.origin[id].node];
    double result = 0;
    if (task.kind == TaskKind::timer) {
      result = 1e9 / static_cast<double>(task.period.count());
    } else if (node.type == NodeType::fusion) {
      // One of the inputs completes each set; which one depends on phases.
      const TaskId first = id - *tasks_.origin[id].input;
      result = input_rate(first);
      for (TaskId i = 1; i < node.inputs.size(); ++i) result = std::min(result, input_rate(first + i));
      result /= static_cast<double>(node.inputs.size());
    } else {
      result = input_rate(id);
    }
    return rate_[id] = result;
  }

  double input_rate(TaskId id) {
    double sum = 0;
    for (const TaskId publisher : publishers_[id]) sum += rate(publisher);
    return sum;
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  std::vector<std::vector<TaskId>> publishers_;
  std::vector<double> rate_;
};

Duration scaled(Duration duration, double factor) {
  return Duration(std::llround(static_cast<double>(duration.count()) * factor));
}

}  // namespace

const Node* Graph::find(const std::string& node) const {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const Node& n) { return n.name == node; });
  return found == nodes.end() ? nullptr : &*found;
}

GraphTasks make_tasks(const Graph& graph) {
  GraphTasks tasks;
  tasks.set.groups.clear();
  std::unordered_map<std::string, std::vector<TaskId>> subscribers;
  for (std::uint32_t n = 0; n < graph.nodes.size(); ++n) {
    const Node& node = graph.nodes[n];
    tasks.set.groups.push_back(node.group);
    for (std::uint32_t i = 0; i < node.inputs.size(); ++i) {
      subscribers[node.inputs[i].topic].push_back(tasks.set.size());
      tasks.set.tasks.push_back(subscription_task(node, node.inputs[i], n));
      tasks.origin.push_back({n, i});
    }
    if (has_timer(node)) {
      tasks.set.tasks.push_back(timer_task(node, n));
      tasks.origin.push_back({n, std::nullopt});
    }
  }
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin& origin = tasks.origin[id];
    if (const std::string* topic = published_topic(graph.nodes[origin.node], origin)) {
      if (const auto found = subscribers.find(*topic); found != subscribers.end()) {
        tasks.set.tasks[id].feeds = found->second;
      }
    }
  }
  return tasks;
}

std::vector<double> activation_rates(const Graph& graph, const GraphTasks& tasks) {
  return Rates(graph, tasks).all();
}

double load_percent(const Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  const std::vector<double> rates = activation_rates(graph, tasks);
  double load = 0;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    load += rates[id] * static_cast<double>(tasks.set[id].wcet.count()) / 1e9;
  }
  return load * 100;
}

void scale_to_load(Graph& graph, double percent) {
  if (!(percent >= 0) || !std::isfinite(percent)) {
    throw std::invalid_argument("a load of " + std::to_string(percent) +
                                " percent is impossible; give 0 (no work) or more");
  }
  const double load = load_percent(graph);
  if (load == 0 && percent > 0) {
    throw std::invalid_argument("graph " + graph.name +
                                " has no work that could be scaled to a load; give its " +
                                "nodes execution times, or ask for no load");
  }
  const double factor = percent == 0 ? 0 : percent / load;
  for (Node& node : graph.nodes) {
    node.execution_time = scaled(node.execution_time, factor);
    node.best_case_execution_time = scaled(node.best_case_execution_time, factor);
  }
}

}  // namespace hotpath
