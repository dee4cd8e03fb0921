// SPDX-License-Identifier: Apache-2.0
#include "random_systems.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/text.hpp"
#include "simulated/simulated_system.hpp"

namespace hotpath::test {

namespace {

/// Some timers become ready up to a third of their periods late.
void draw_jitter(Random& random, Graph& graph) {
  for (Node& node : graph.nodes) {
    if (node.type == NodeType::callbacks) continue;
    Callback& timer = node.callbacks.back();
    if (timer.period > Duration{} && chance(random, 60))
      timer.release_jitter = Duration(draw(random, 0, timer.period.count() / (chance(random, 50) ? 3 : 50)));
  }
}

/// Some callbacks are services, often long ones, which run ahead of their priorities after 1 to 150 ms. In
/// half of the graphs the work does not fit into the time.
void draw_services(Random& random, Graph& graph) {
  for (Node& node : graph.nodes) {
    const auto is_timer = [](const Callback& callback) { return !callback.input; };
    if (std::ranges::any_of(node.callbacks, is_timer) || !chance(random, 50)) continue;
    node.type = NodeType::callbacks;
    for (Callback& callback : node.callbacks) {
      if (callback.input && chance(random, 60))
        callback.entity = static_cast<EntityKind>(draw(random, 1, 3));  // service, client, waitable
    }
    for (Callback& callback : node.callbacks) {
      const std::int64_t longer = callback.entity != EntityKind::subscription ? draw(random, 1, 4) : 1;
      callback.worst *= longer, callback.best *= longer;
    }
  }
  graph.service_wait = Duration(draw(random, 1'000'000, chance(random, 60) ? 30'000'000 : 150'000'000));
  scale_to_load(graph, static_cast<double>(draw(random, 40, 160)));
}

}  // namespace

void draw_phases(Random& random, const Graph& graph, GraphTasks& tasks) {
  const Phases kinds[] = {Phases::random, Phases::random, Phases::synchronous, Phases::creation};
  PhaseOptions options;
  options.seed = random();
  const std::vector<Duration> first =
      make_phases(graph, tasks, kinds[static_cast<std::size_t>(draw(random, 0, 3))], options);
  for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
}

Graph draw_lines(Random& random) {
  Graph graph;
  graph.name = "lines";
  graph.platform.cores = 4;
  const CallbackGroup group =
      chance(random, 50) ? CallbackGroup::reentrant : CallbackGroup::mutually_exclusive;
  const std::int64_t lines = draw(random, 2, 6);
  for (std::int64_t line = 0; line < lines; ++line) {
    Chain chain{program::concat("chain", line), {}, {}, ""};
    const std::int64_t period = 1'000'000 * draw(random, 2, 20) * (chance(random, 50) ? 10 : 1);
    const std::int64_t length = draw(random, 1, 4), share = draw(random, 1, 80);
    for (std::int64_t k = 0; k < length; ++k) {
      ReferenceNode node;
      node.name = program::concat("N", line, "_", k);
      node.type = k == 0 ? NodeType::sensor : NodeType::transform;
      if (k == 0) node.period = node.deadline = Duration(period);
      if (k > 0) node.inputs = {{chain.nodes.back(), 1, std::nullopt}};
      node.outputs = {node.name};
      node.group = group;
      node.execution_time =
          Duration(draw(random, 1, std::max<std::int64_t>(1, period * share / 100 / length)));
      node.best_case_execution_time = node.execution_time / draw(random, 1, 4);
      chain.nodes.push_back(node.name);
      graph.nodes.emplace_back(node);
    }
    chain.sources = {chain.nodes.front()};
    chain.sink = chain.nodes.back();
    graph.chains.push_back(chain);
  }
  std::shuffle(graph.nodes.begin(), graph.nodes.end(), random);
  return graph;
}

void draw_deliveries(Random& random, Graph& graph) {
  std::map<std::string, std::vector<std::string>> subscribers;
  for (const Node& node : graph.nodes) {
    for (const Input& input : node.inputs) subscribers[input.topic].push_back(node.name);
  }
  for (auto& [topic, nodes] : subscribers) {
    if (nodes.size() < 2) continue;
    std::ranges::shuffle(nodes, random);
    graph.delivery[topic] = {nodes};
  }
}

Graph draw_graph(Random& random, std::uint64_t seed, bool any_delivery) {
  Graph graph = random_graph(random);
  Random own(seed);  // the graphs of the other seeds stay the same
  if (seed % 3 == 1 || any_delivery) draw_deliveries(own, graph);
  if (any_delivery) {
    for (auto& [topic, order] : graph.delivery) order.nodes.clear();
  }
  if (seed % 7 == 2) draw_jitter(own, graph);
  if (seed % 6 == 5) draw_services(own, graph);
  return graph;
}

setup::ExecutorSpec random_deployment(Random& random, Graph& graph, GraphTasks& tasks) {
  GraphPlatform& platform = graph.platform;
  platform.release_cost = platform.pass_cost = {};
  if (chance(random, 50)) platform.wake_up_latency = {};
  platform.timer_thread = TimerThread::by_executor;
  platform.cores = static_cast<unsigned>(draw(random, 1, 3));
  if (chance(random, 50)) platform.timer_thread = TimerThread::raised;
  const std::int64_t more_work = draw(random, 1, platform.cores);
  for (Task& task : tasks.set.tasks) task.wcet *= more_work, task.bcet *= more_work;
  Deployment plan;
  plan.name = "deployment";
  std::vector<std::string> names = {"rm-ro:first", "fp-ro:fifo"};
  for (const ExecutorEntry& e : executors()) {
    const bool one_thread = !e.traits.many_workers && e.traits.timers != TimerHandling::release_and_execute;
    if (one_thread) names.emplace_back(e.name);
  }
  const std::int64_t last = chance(random, 30) ? static_cast<std::int64_t>(tasks.set.size()) - 1 : 4;
  for (std::int64_t e = 0; e <= last; ++e) {
    DeployedExecutor& executor = plan.executors.emplace_back();
    executor.name = "executor" + std::to_string(e);
    executor.executor = names[static_cast<std::size_t>(draw(random, 0, std::ssize(names) - 1))];
    const bool few = chance(random, 50);
    if (!chance(random, 10)) {
      executor.policy = {
          ThreadPolicy::Class::fifo, static_cast<int>(draw(random, 1, few ? 4 : 95)), {}, {}, {}};
    }
    if (executor.policy.priority > 0 || chance(random, 50)) {
      executor.processors = {static_cast<int>(draw(random, 0, platform.cores - 1))};
    }
  }
  const bool by_task = chance(random, 30);
  std::vector<std::uint32_t> of_node;
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    of_node.push_back(static_cast<std::uint32_t>(draw(random, 0, last)));
  }
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    plan.executor_of.push_back(by_task ? static_cast<std::uint32_t>(draw(random, 0, last))
                                       : of_node[tasks.origin[id].node]);
  }
  return setup::deploy(std::move(plan), {});
}

std::optional<Trace> simulated(const Graph& graph, const GraphTasks& given,
                               const setup::ExecutorSpec& executor, const ExecutionTimes& times,
                               Duration duration, std::vector<ChainObservation>* observations) {
  GraphTasks tasks = given;
  tasks.set = with_releases(std::move(tasks.set), times);
  GraphWorkload workload(graph, tasks, times, observations);
  SimulationOptions options;
  options.platform = make_platform(graph, *setup::parts(executor).front().entry);
  options.duration = duration;
  options.max_backlog = 1000;
  options.deliveries = times.deliveries();
  const simulated::System system(executor, graph, tasks);
  Trace trace;
  TraceRecorder recorder(trace);
  try {
    simulate(tasks.set, system.executors(), system.executor_of(), workload, options, &recorder);
    return trace;
  } catch (const SimulationError&) {
    return std::nullopt;
  }
}

std::string deployment_text(const setup::ExecutorSpec& executor, const TaskSet& set) {
  std::string all;
  for (TaskId id = 0; !executor.entry && id < set.size(); ++id) {
    const Deployment& plan = executor.plan;
    const DeployedExecutor& e = plan.executors[plan.executor_of[id]];
    all +=
        program::concat("\n", set[id].name, " of ", set[id].wcet.count(), " ns: ", e.name, " ", e.executor,
                        " ", to_string(e.policy), " on ", e.processors.empty() ? -1 : e.processors.front());
  }
  return all;
}

}  // namespace hotpath::test
