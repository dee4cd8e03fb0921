// SPDX-License-Identifier: Apache-2.0
// Costs of the simulator without a trace: the paper's task set and Autoware for ten minutes, and a
// large graph; and the growth of the exploration of several threads.
#include <numeric>

#include "bounds/bounds.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "microbench/measurement.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::microbench {
namespace {

/// A graph with the default phases of simulations.
struct Subject {
  explicit Subject(const char* name) : graph(load_graph(find_graph(name))), tasks(make_tasks(graph)) {
    setup::set_phases(tasks.set, make_phases(graph, tasks, Phases::creation));
  }
  Graph graph;
  GraphTasks tasks;
};

/// One simulation of ten minutes per iteration, each with a new workload; counts jobs.
void graph_for_ten_minutes(benchmark::State& state, const Subject& subject, const ExecutorEntry& executor) {
  const WorstCaseTimes times(subject.tasks.set);
  SimulationOptions options;
  options.platform = make_platform(subject.graph, executor);
  options.duration = 600s;
  std::uint64_t jobs = 0;
  for (auto _ : state) {
    GraphWorkload workload(subject.graph, subject.tasks, times);
    const auto scheduler = executor.make(subject.tasks.set, {.workers = 2});
    jobs += simulate(subject.tasks.set, *scheduler, workload, options).jobs;
  }
  state.counters["jobs_per_s"] = benchmark::Counter(static_cast<double>(jobs), benchmark::Counter::kIsRate);
}

/// A graph of the size of Autoware.Universe 2022.12 as launched (the public report of
/// tier4/caret_report): 131 nodes with 66 timers, mostly of 100 ms and 1 s, and 216 subscriptions,
/// each callback in its own group. It had some 3500 jobs a second of 1 ms on average.
Graph universe() {
  Graph graph;
  for (std::uint32_t n = 0; n < 131; ++n) {
    const std::string name = program::concat("N", n);
    Node& node = graph.nodes.emplace_back();
    node.name = name;
    node.outputs = {name};
    for (std::uint32_t c = 0; c < (n < 20 ? 3 : 2); ++c) {
      Callback& callback = node.callbacks.emplace_back();
      callback.task = program::concat(name, "/", c);
      callback.worst = callback.best = 1ms;
      callback.group = c;
      node.groups.push_back(CallbackGroup::mutually_exclusive);
      node.group_names.push_back(program::concat("g", c));
      if (c == 0) callback.publishes.emplace_back().topic = name;
      if (c == 0 && n < 66) {
        callback.period = callback.deadline = n % 22 == 5 ? 20ms : n < 42 ? 100ms : 1s;
      } else {
        callback.input = static_cast<std::uint32_t>(node.inputs.size());
        node.inputs.push_back({.topic = program::concat("N", n == 0 ? 1 : (n * 37 + c) % n)});
      }
    }
  }
  return graph;
}

/// 375 executors on 16 cores; twelve executors are multi-threaded, and 93 have no tasks.
void simulate_universe(benchmark::State& state) {
  constexpr std::uint32_t kExecutors = 375, kMultiThreaded = 12;
  constexpr Duration kLength = 10s;
  const Graph graph = universe();
  GraphTasks tasks = make_tasks(graph);
  setup::set_phases(tasks.set, make_phases(graph, tasks, Phases::creation));
  const WorstCaseTimes times(tasks.set);
  std::vector<std::uint32_t> executor_of(tasks.set.size());
  std::iota(executor_of.begin(), executor_of.end(), 0U);
  for (Task& task : tasks.set.tasks) task.local = false;
  for (auto _ : state) {
    std::vector<std::unique_ptr<Scheduler>> schedulers;
    std::vector<SimulatedExecutor> executors;
    for (std::uint32_t e = 0; e < kExecutors; ++e) {
      TaskSet own = tasks.set;
      if (e < own.size()) own.tasks[e].local = true;
      const ExecutorEntry& entry = *find_executor(e < kMultiThreaded ? "multi" : "default");
      schedulers.push_back(entry.make(own, {.workers = 4}));
      executors.push_back(
          {schedulers.back().get(), std::vector<SimulatedThread>(schedulers.back()->workers().size()), 8});
    }
    GraphWorkload workload(graph, tasks, times);
    SimulationOptions options;
    options.platform = reference_platform(*find_executor("default"), 0);
    options.platform.cores = 16;
    options.duration = kLength;
    benchmark::DoNotOptimize(simulate(tasks.set, executors, executor_of, workload, options).jobs);
  }
}

/// The chains of three_chains, or the first and the last, once or twice. Execution times are
/// at least `least` of the worst case.
Graph reentrant_chains(std::size_t chains, double least) {
  Graph graph = load_graph(find_graph("three_chains"));
  if (chains != 3) {
    graph.chains.erase(graph.chains.begin() + 1);
    std::erase_if(graph.nodes.front().callbacks, [](const Callback& c) { return c.task.starts_with("N/b"); });
  }
  for (Callback& c : graph.nodes.front().callbacks)
    c.best = round<Duration>(least * std::chrono::duration<double, std::nano>(c.worst));
  if (chains == 4) make_copies(graph, 2);
  graph.platform.cores = 4;
  return graph;
}

/// An exploration under `multi`, which counts states up to the limit of `hotpath analyze --exact`.
void explore_threads(benchmark::State& state, unsigned threads, const Graph& graph) {
  struct NoObserver final : ExplorationObserver {
    void ended(const JobRecord&, ExploredInstant&) override {}
  };
  const ExecutorEntry& executor = *find_executor("multi");
  GraphTasks tasks = make_tasks(graph);
  setup::set_phases(tasks.set, make_phases(graph, tasks, Phases::synchronous));
  const WorstCaseTimes times(tasks.set);
  ExplorationOptions options;
  options.platform = make_platform(graph, executor);
  options.max_states = bounds::kMostStatesOfThreads;
  const auto scheduler = executor.make(tasks.set, {.workers = threads});
  for (auto _ : state) {
    NoObserver observer;
    const GraphWorkload workload(graph, tasks, times);
    const std::size_t states = explore(tasks.set, *scheduler, workload, options, observer).states;
    state.counters["states"] = static_cast<double>(states);
  }
}

}  // namespace

void register_all(bool quick) {
  const double min_time = quick ? 0.02 : 0.5;
  const auto add = [](const std::string& name, auto measure) {
    return benchmark::RegisterBenchmark(name.c_str(), measure)->Unit(benchmark::kMillisecond);
  };
  for (const char* graph : {"timers_only_90", "autoware"}) {
    const auto subject = std::make_shared<Subject>(graph);
    for (const ExecutorEntry& executor : executors()) {
      add(program::concat("simulate_600s/", graph, "/", executor.name), [subject, &executor](auto& state) {
        graph_for_ten_minutes(state, *subject, executor);
      })->MinTime(min_time);
    }
  }
  add("simulate_10s/autoware_universe", simulate_universe)->MinTime(min_time);
  for (const unsigned threads : {2U, 3U}) {
    for (const std::size_t chains : {2, 3, 4}) {
      for (const int width : {0, 10, 50}) {  // of the intervals, in percent of the worst case
        const Graph graph = reentrant_chains(chains, 1 - width / 100.0);
        add(program::concat("explore/multi:", threads, "/chains:", chains, "/width:", width),
            [=](auto& state) { explore_threads(state, threads, graph); })
            ->Iterations(1);
      }
    }
  }
}

}  // namespace hotpath::microbench
