// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <tuple>
#include <unordered_map>

namespace hotpath {

bool same_rule(const Publication& a, const Publication& b) {
  return std::tie(a.topic, a.rule, a.of, a.n, a.first) == std::tie(b.topic, b.rule, b.of, b.n, b.first);
}

bool Callback::waits_for_sets() const {
  return !publishes.empty() &&
         std::ranges::count(publishes, PublishRule::all_new, &Publication::rule) == std::ssize(publishes);
}

std::vector<Duration> values_of(const std::vector<DurationQuantile>& quantiles) {
  constexpr std::size_t kValues = 200;
  std::vector<Duration> values;
  auto next = quantiles.begin() + 1;
  for (std::size_t i = 0; i < kValues; ++i) {
    const double percent = 100 * (static_cast<double>(i) + 0.5) / kValues;
    while (percent > next->percent) ++next;
    const DurationQuantile& before = *std::prev(next);
    const double share = (percent - before.percent) / (next->percent - before.percent);
    values.push_back(before.time +
                     Duration(std::llround(share * static_cast<double>((next->time - before.time).count()))));
  }
  values.front() = quantiles.front().time;
  values.back() = quantiles.back().time;
  return values;
}

bool operator==(const StatedWork& a, const StatedWork& b) {
  const bool same = a.measured && b.measured ? *a.measured == *b.measured : a.measured == b.measured;
  return same && a.worst == b.worst && a.best == b.best && a.quantiles == b.quantiles;
}

std::vector<Callback> callbacks_of(const Node& node) {
  std::vector<Callback> callbacks = node.callbacks;
  std::vector<bool> stored(node.inputs.size(), false);
  for (const Callback& callback : callbacks)
    for (const Publication& publication : callback.publishes)
      for (const std::uint32_t input : publication.of) stored[input] = true;
  for (Callback& c : callbacks) c.stores_only = c.input && stored[*c.input] && c.publishes.empty();
  return callbacks;
}

namespace {

Task make_task(const Graph& graph, const Node& node, const Callback& callback, std::uint32_t first_group) {
  Task task;
  static_cast<TimerTimes&>(task) = callback;
  task.name = callback.task;
  task.kind = callback.input ? TaskKind::subscription : TaskKind::timer;
  task.phase = callback.phase.value_or(Duration::zero());
  task.wcet = callback.worst;
  task.bcet = callback.best;
  task.priority = callback.priority;
  task.group = first_group + callback.group;
  task.entity = callback.entity;
  task.service = is_service(callback.entity);
  if (!callback.input) return task;
  const Input& input = node.inputs[*callback.input];
  task.depth = input.depth;
  if (!task.service && graph.intra_process.contains(input.topic)) task.entity = EntityKind::intra_process;
  return task;
}

/// The tasks of the task's node.
std::vector<TaskId> of_same_node(const GraphTasks& tasks, TaskId id) {
  std::vector<TaskId> all;
  const std::uint32_t node = tasks.origin[id].node;
  for (TaskId t = id - tasks.origin[id].callback; t < tasks.set.size() && tasks.origin[t].node == node; ++t)
    all.push_back(t);
  return all;
}

/// Computes rates recursively, from a task to the tasks that publish its topic.
class Rates {
 public:
  explicit Rates(const GraphTasks& tasks)
      : tasks_(tasks), publishers_(tasks.set.size()), activations_(tasks.set.size(), kUnknown) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      for (std::size_t p = 0; p < tasks.readers[id].size(); ++p) {
        for (const TaskId reader : tasks.readers[id][p]) publishers_[reader].emplace_back(id, p);
      }
    }
  }

  double rate(TaskId id) {
    const Callback& callback = tasks_.callbacks[id];
    if (!callback.waits_for_sets()) return activations(id);
    double most = 0;
    for (const Publication& p : callback.publishes) most = std::max(most, publications(id, p));
    return most;
  }

 private:
  static constexpr double kUnknown = -1;

  double activations(TaskId id) {
    if (activations_[id] != kUnknown) return activations_[id];
    activations_[id] = 0;  // a task that waits only for itself never runs
    const Task& task = tasks_.set[id];
    double sum = task.kind == TaskKind::timer ? 1e9 / static_cast<double>(task.period.count()) : 0;
    for (const auto& [from, p] : publishers_[id])
      sum += publications(from, tasks_.callbacks[from].publishes[p]);
    return activations_[id] = sum;
  }

  double publications(TaskId id, const Publication& publication) {
    if (publication.rule == PublishRule::every) return activations(id) / publication.n;
    if (publication.rule != PublishRule::all_new) return activations(id);
    // One callback completes each set; which one depends on the phases.
    double slowest = activations(id);
    std::size_t sharers = 0;
    for (const TaskId t : of_same_node(tasks_, id)) {
      const Callback& callback = tasks_.callbacks[t];
      if (callback.input && std::ranges::count(publication.of, *callback.input) > 0)
        slowest = std::min(slowest, activations(t));
      for (const Publication& p : callback.publishes) sharers += same_rule(p, publication);
    }
    return slowest / static_cast<double>(sharers);
  }

  const GraphTasks& tasks_;
  std::vector<std::vector<std::pair<TaskId, std::size_t>>> publishers_;
  std::vector<double> activations_;
};

Duration scaled(Duration duration, double factor) {
  return Duration(std::llround(static_cast<double>(duration.count()) * factor));
}

void scale(Callback& callback, double factor) {
  callback.worst = scaled(callback.worst, factor);
  callback.best = scaled(callback.best, factor);
  for (DurationQuantile& quantile : callback.quantiles) quantile.time = scaled(quantile.time, factor);
  if (!callback.measured) return;
  std::vector<Duration> measured = *callback.measured;
  for (Duration& duration : measured) duration = scaled(duration, factor);
  callback.measured = std::make_shared<const std::vector<Duration>>(std::move(measured));
}

}  // namespace

const Node* Graph::find(const std::string& node_or_task) const {
  const std::string_view wanted = std::string_view(node_or_task).substr(0, node_or_task.find('/'));
  const auto node = std::ranges::find(nodes, wanted, &Node::name);
  return node == nodes.end() ? nullptr : &*node;
}

std::vector<std::string> Graph::node_names() const {
  std::vector<std::string> names;
  for (const Node& node : nodes) names.push_back(node.name);
  return names;
}

bool Graph::has_callbacks() const { return std::ranges::count(nodes, NodeType::callbacks, &Node::type) > 0; }

std::vector<TaskId> GraphTasks::merged_inputs(TaskId id) const {
  std::vector<TaskId> merged;
  for (const TaskId t : of_same_node(*this, id)) {
    const auto merges = [&](const Publication& p) { return std::ranges::count(p.of, *origin[t].input) > 0; };
    const std::vector<Publication>& own = callbacks[id].publishes;
    if (origin[t].input && (t == id || std::any_of(own.begin(), own.end(), merges))) merged.push_back(t);
  }
  return merged;
}

std::vector<TaskId> GraphTasks::downstream(TaskId id) const {
  std::vector<TaskId> next = set[id].feeds;
  for (const TaskId t : of_same_node(*this, id)) {
    if (t != id && std::ranges::count(merged_inputs(t), id) > 0) next.push_back(t);
  }
  return next;
}

std::vector<TaskId> GraphTasks::cycle() const {
  std::vector<std::size_t> followed(set.size(), 0);  // by task: how many of those that it feeds
  for (TaskId start = 0; start < set.size(); ++start) {
    std::vector<TaskId> path = {start};
    while (!path.empty()) {
      const TaskId id = path.back();
      if (followed[id] == set[id].feeds.size()) {
        path.pop_back();
        continue;
      }
      const TaskId next = set[id].feeds[followed[id]++];
      const auto open = std::ranges::find(path, next);
      if (open != path.end()) return {open, path.end()};
      path.push_back(next);
    }
  }
  return {};
}

std::vector<TaskId> GraphTasks::subscriptions_to_create() const {
  std::vector<std::vector<TaskId>> before(set.size());  // by task: those that a topic reaches earlier
  for (const auto& of_task : readers) {
    for (const std::vector<TaskId>& topic : of_task) {
      for (std::size_t i = 1; i < topic.size(); ++i) before[topic[i]].push_back(topic[i - 1]);
    }
  }
  std::vector<TaskId> left, created;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (origin[id].input) left.push_back(id);
  }
  const auto waits = [&](TaskId id) {
    const auto is_left = [&](TaskId other) { return std::ranges::find(left, other) != left.end(); };
    return std::ranges::any_of(before[id], is_left);
  };
  const auto first_of_node = [&](TaskId id) {
    const auto same = [&](TaskId other) { return origin[other].node == origin[id].node; };
    return *std::ranges::find_if(left, same) == id;
  };
  while (!left.empty()) {
    auto next = std::ranges::find_if(left, [&](TaskId id) { return !waits(id) && first_of_node(id); });
    if (next == left.end()) next = std::ranges::find_if_not(left, waits);
    created.push_back(*next);
    left.erase(next);
  }
  return created;
}

std::vector<std::uint32_t> cut_cycles(std::vector<std::vector<std::uint32_t>>& next,
                                      const std::vector<std::uint32_t>& from) {
  enum class State : std::uint8_t { unseen, open, done };
  std::vector<State> state(next.size(), State::unseen);
  std::vector<std::uint32_t> order;
  const std::function<void(std::uint32_t)> visit = [&](std::uint32_t id) {
    if (state[id] != State::unseen) return;
    state[id] = State::open;
    for (const std::uint32_t to : next[id]) visit(to);
    std::erase_if(next[id], [&](std::uint32_t to) { return state[to] == State::open; });
    state[id] = State::done;
    order.push_back(id);
  };
  for (const std::uint32_t id : from) visit(id);
  return order;
}

std::vector<std::string> subscribers_of(const Graph& graph, const std::string& topic) {
  std::vector<std::string> names;
  for (const Node& node : graph.nodes) {
    if (std::ranges::count(node.inputs, topic, &Input::topic) > 0) names.push_back(node.name);
  }
  return names;
}

std::vector<std::string> unknown_deliveries(const Graph& graph) {
  std::vector<std::string> topics;
  for (const auto& [topic, order] : graph.delivery) {
    if (order.unknown() && subscribers_of(graph, topic).size() > 1) topics.push_back(topic);
  }
  return topics;
}

Graph with_drawn_deliveries(Graph graph, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (const std::string& topic : unknown_deliveries(graph)) {
    std::vector<std::string>& nodes = graph.delivery[topic].nodes = subscribers_of(graph, topic);
    std::ranges::shuffle(nodes, random);
  }
  return graph;
}

void set_delivery(const Graph& graph, GraphTasks& tasks) {
  std::unordered_map<std::string, std::vector<TaskId>> subscribers;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin& origin = tasks.origin[id];
    if (origin.input) subscribers[graph.nodes[origin.node].inputs[*origin.input].topic].push_back(id);
  }
  for (const auto& [topic, order] : graph.delivery) {
    const auto place = [&, &nodes = order.nodes](TaskId id) {
      return std::ranges::find(nodes, graph.nodes[tasks.origin[id].node].name) - nodes.begin();
    };
    std::ranges::stable_sort(subscribers[topic], {}, place);
  }
  tasks.readers.assign(tasks.set.size(), {});
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    std::vector<TaskId>& feeds = tasks.set.tasks[id].feeds;
    feeds.clear();
    for (const Publication& publication : tasks.callbacks[id].publishes) {
      const std::vector<TaskId>& readers = subscribers[publication.topic];
      tasks.readers[id].push_back(readers);
      feeds.insert(feeds.end(), readers.begin(), readers.end());
    }
  }
}

GraphTasks make_tasks(const Graph& graph) {
  GraphTasks tasks;
  tasks.set.groups.clear();
  for (std::uint32_t n = 0; n < graph.nodes.size(); ++n) {
    const Node& node = graph.nodes[n];
    const auto first_group = static_cast<std::uint32_t>(tasks.set.groups.size());
    tasks.set.groups.insert(tasks.set.groups.end(), node.groups.begin(), node.groups.end());
    std::uint32_t position = 0;
    for (Callback& callback : callbacks_of(node)) {
      tasks.set.tasks.push_back(make_task(graph, node, callback, first_group));
      tasks.origin.push_back({n, callback.input, position++});
      tasks.callbacks.push_back(std::move(callback));
    }
  }
  set_delivery(graph, tasks);
  return tasks;
}

std::vector<double> activation_rates(const GraphTasks& tasks) {
  Rates rates(tasks);
  std::vector<double> all(tasks.set.size());
  for (TaskId id = 0; id < all.size(); ++id) all[id] = rates.rate(id);
  return all;
}

double load_percent(const Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  const std::vector<double> rates = activation_rates(tasks);
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
                                " has no work to scale; give its nodes execution times, or omit the load");
  }
  const double factor = percent == 0 ? 0 : percent / load;
  for (Node& node : graph.nodes) {
    for (Callback& callback : node.callbacks) scale(callback, factor);
  }
}

}  // namespace hotpath
