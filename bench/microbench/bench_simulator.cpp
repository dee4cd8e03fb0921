// SPDX-License-Identifier: Apache-2.0
// What simulating costs, without a trace: the paper's task set and Autoware for ten minutes, and how the cost
// grows with the number of tasks.
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "microbench/measurement.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::gbench {
namespace {

/// A graph with the phases that simulations have by default.
struct Subject {
  explicit Subject(const char* name) : graph(load_graph(find_graph(name))), tasks(make_tasks(graph)) {
    set_phases(tasks.set, make_phases(graph, tasks, Phases::creation));
  }
  Graph graph;
  GraphTasks tasks;
};

/// `n` timers of 20 periods between 10 and 960 ms at 80 % of one core.
TaskSet timers(std::int64_t n) {
  TaskSet set;
  for (std::int64_t i = 0; i < n; ++i) {
    Task& t = set.tasks.emplace_back();
    t.period = t.deadline = 10ms * (1 + (i * 7919) % 20 * 5);
    t.phase = t.period * i / n;
    t.wcet = t.bcet = t.period * 8 / (10 * n);
  }
  return set;
}

/// One simulation per iteration, over a new workload each; counts jobs.
template <class MakeWorkload>
void simulate_executor(benchmark::State& state, const TaskSet& set, const ExecutorEntry& executor,
                       const Platform& platform, Duration duration, MakeWorkload make_workload) {
  SimulationOptions options;
  options.platform = platform;
  options.duration = duration;
  std::uint64_t jobs = 0;
  for (auto _ : state) {
    auto workload = make_workload();
    const auto scheduler = executor.make(set, {.workers = 2});
    jobs += simulate(set, *scheduler, workload, options).jobs;
  }
  const auto all = static_cast<double>(jobs);
  state.counters["jobs_per_s"] = benchmark::Counter(all, benchmark::Counter::kIsRate);
  state.counters["jobs"] = benchmark::Counter(all, benchmark::Counter::kAvgIterations);
}

void graph_for_ten_minutes(benchmark::State& state, const Subject& subject, const ExecutorEntry& executor) {
  const WorstCaseTimes times(subject.tasks.set);
  simulate_executor(state, subject.tasks.set, executor, make_platform(subject.graph, executor), 600s,
                    [&] { return GraphWorkload(subject.graph, subject.tasks, times); });
}

void growing_set(benchmark::State& state, const ExecutorEntry& executor) {
  const TaskSet set = timers(state.range(0));
  const WorstCaseTimes times(set);
  simulate_executor(state, set, executor, default_platform(executor), 2s,
                    [&] { return PublishingWorkload(times); });
  state.SetComplexityN(state.range(0));
}

}  // namespace

void register_all(bool quick) {
  const double min_time = quick ? 0.02 : 0.5;
  for (const char* graph : {"timers_only_90", "autoware"}) {
    const auto subject = std::make_shared<Subject>(graph);
    for (const ExecutorEntry& executor : executors()) {
      const std::string name = std::string("simulate_600s/") + graph + "/" + std::string(executor.name);
      benchmark::RegisterBenchmark(
          name.c_str(),
          [subject, &executor](benchmark::State& s) { graph_for_ten_minutes(s, *subject, executor); })
          ->MinTime(min_time)
          ->Unit(benchmark::kMillisecond);
    }
  }
  for (const char* executor : {"default", "events-ro", "rm-ro", "rm-re", "edf-ro"}) {
    const ExecutorEntry& entry = *find_executor(executor);
    // Every poll of a wait set looks at all tasks.
    const bool polls = entry.traits.family == Family::wait_set;
    const std::int64_t largest = quick || polls ? 1'000 : 100'000;
    benchmark::RegisterBenchmark(("simulate/" + std::string(executor) + "/tasks").c_str(),
                                 [&entry](benchmark::State& s) { growing_set(s, entry); })
        ->RangeMultiplier(10)
        ->Range(10, largest)
        ->MinTime(min_time)
        ->Unit(benchmark::kMillisecond)
        ->Complexity(polls ? benchmark::oNSquared : benchmark::oNLogN);
  }
}

}  // namespace hotpath::gbench
