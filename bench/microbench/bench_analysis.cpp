// SPDX-License-Identifier: Apache-2.0
// Time of each analysis of one task set by number of tasks, and time of the whole experiments.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/george_1996.hpp"
#include "hotpath/analysis/graph_bounds.hpp"
#include "hotpath/analysis/nasri_2017.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/analysis/teper_2024.hpp"
#include "hotpath/analysis/waters_experiment.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "reference_simulation.hpp"

namespace hotpath {
namespace {

/// `n` tasks with the periods and relative execution times of WATERS and a utilisation of about
/// 0.8.
PeriodicTasks tasks_of_size(std::size_t n) {
  RandomStream random(1, {n});
  PeriodicTasks tasks;
  while (tasks.size() < n) {
    const PeriodicTasks more = waters_task_set(0.8, random);
    tasks.insert(tasks.end(), more.begin(), more.end());
  }
  random.shuffle(std::span(tasks));
  tasks.resize(n);
  double u = 0;
  for (const PeriodicTask& t : tasks) u += static_cast<double>(t.wcet) / static_cast<double>(t.period);
  for (PeriodicTask& t : tasks) {
    t.wcet = std::max<std::int64_t>(1, static_cast<std::int64_t>(static_cast<double>(t.wcet) * 0.8 / u));
  }
  std::ranges::stable_sort(tasks, {}, &PeriodicTask::period);
  return tasks;
}

template <typename Method>
void per_task_set(benchmark::State& state, Method method) {
  const PeriodicTasks tasks = tasks_of_size(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(method(tasks));
  state.SetComplexityN(state.range(0));
}

#define HOTPATH_PER_TASK_SET(name, method)      \
  BENCHMARK_CAPTURE(per_task_set, name, method) \
      ->RangeMultiplier(10)                     \
      ->Range(10, 1000)                         \
      ->Unit(benchmark::kMicrosecond)
HOTPATH_PER_TASK_SET(brueggen_2015, brueggen_2015);
HOTPATH_PER_TASK_SET(davis_2007, [](const PeriodicTasks& t) { return davis_2007(t); });
HOTPATH_PER_TASK_SET(george_1996, [](const PeriodicTasks& t) { return george_1996(t); });
HOTPATH_PER_TASK_SET(bedarkar_2022, bedarkar_2022);
HOTPATH_PER_TASK_SET(teper_2024_timers, teper_2024_timers);
HOTPATH_PER_TASK_SET(spuri_1996, [](const PeriodicTasks& t) { return spuri_1996(t); });

/// One hyperperiod of the paper's timers-only set, execution times in [0, C + Delta].
void schedule_abstraction(benchmark::State& state) {
  PeriodicTasks tasks = paper_timers_only(static_cast<int>(state.range(0)));
  for (PeriodicTask& t : tasks) t.wcet += 833'000;
  const auto policy = static_cast<SagPolicy>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(nasri_2017(sag_jobs(tasks, policy)).states);
}
BENCHMARK(schedule_abstraction)
    ->ArgsProduct({{60, 80, 90}, {0, 1}})
    ->ArgNames({"utilisation", "edf"})
    ->Unit(benchmark::kMillisecond);

/// Section VII-B: 3 x 1000 task sets with all chains; 0: the paper's method, 1: all methods.
void waters(benchmark::State& state) {
  WatersOptions options;
  if (state.range(0) == 1) {
    options.methods = {WatersMethod::brueggen_davare, WatersMethod::davis_davare, WatersMethod::davis_duerr,
                       WatersMethod::davis_kloda, WatersMethod::davis_guenzel};
  }
  for (auto _ : state) benchmark::DoNotOptimize(run_waters(options).rows.size());
}
BENCHMARK(waters)->Arg(0)->Arg(1)->ArgName("all_methods")->Unit(benchmark::kSecond)->UseRealTime();

/// The property of the tests, for a million random sets: Theorem 1 >= exact NP-FP >= exploration >=
/// simulation.
void two_roads(benchmark::State& state) {
  std::uint64_t set = 0;
  for (auto _ : state) {
    RandomStream random(7, {set++});
    RandomSet what;
    what.periods = {4, 5, 8, 10, 20, 40};
    what.shorter_runs = true;
    const PeriodicTasks tasks = random_tasks(random, what);
    const ResponseTimes sufficient = brueggen_2015(tasks);
    if (!schedulable(tasks, sufficient)) continue;
    const ResponseTimes exact_times = davis_2007(tasks, TimeModel::discrete);
    const std::vector<SagJob> jobs = sag_jobs(tasks, SagPolicy::fixed_priority);
    const ResponseTimes explored = sag_response_times(jobs, nasri_2017(jobs), tasks.size());
    auto run = draw_jobs(tasks, hyperperiod(tasks, "two_roads", "none"), random);
    simulate(run, Rule::fixed_priority);
    const std::vector<std::int64_t> seen = largest_response_times(run, tasks.size());
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      if (*sufficient[k] < *exact_times[k] || *exact_times[k] < *explored[k] || *explored[k] < seen[k]) {
        state.SkipWithError(("the order is broken for task " + std::to_string(k) + as_graph(tasks)).c_str());
      }
    }
  }
}
BENCHMARK(two_roads)->Iterations(1'000'000)->Unit(benchmark::kMicrosecond);

/// `n` tasks in six layers: timers in the first, and a fusion of two tasks at every fifth task of
/// the others.
CallbackGraph graph_of_size(TaskId n) {
  constexpr std::array kPeriods_ms = {10, 20, 50, 100, 200, 500};
  RandomStream random(1, {n});
  CallbackGraph graph;
  const TaskId layer = n / 6;
  const auto above = [&](TaskId id) {
    return (id / layer - 1) * layer + static_cast<TaskId>(random.below(layer));
  };
  const auto completes_join = [&](TaskId id) {
    return id % 5 == 4 && id > layer && id / layer == (id - 1) / layer;
  };
  for (TaskId id = 0; id < n; ++id) {
    Task& task = graph.set.tasks.emplace_back();
    task.name = std::to_string(id);
    task.kind = id < layer ? TaskKind::timer : TaskKind::subscription;
    task.wcet = std::chrono::microseconds(5);
    task.priority = id;
    if (id < layer) {
      task.period = task.deadline = std::chrono::milliseconds(kPeriods_ms[random.below(6)]);
      continue;
    }
    if (completes_join(id)) graph.joins.push_back({{id - 1, id}});
    const TaskId publisher = above(id);
    graph.set.tasks[publisher].feeds.push_back(id);
    if (completes_join(publisher)) graph.set.tasks[publisher - 1].feeds.push_back(id);
    if (completes_join(publisher + 1)) graph.set.tasks[publisher + 1].feeds.push_back(id);
  }
  graph.reads.resize(n);
  graph.every.resize(n, 1);
  return graph;
}

/// Bounds of all tasks of a graph. Bar: 2 s for 1000 tasks.
void graph(benchmark::State& state, const char* executor) {
  const CallbackGraph callbacks = graph_of_size(static_cast<TaskId>(state.range(0)));
  const ExecutorEntry& entry = *find_executor(executor);
  const BoundedSystem system{callbacks, entry, {}, default_platform(entry)};
  for (auto _ : state) benchmark::DoNotOptimize(graph_bounds(system).size());
}
#define HOTPATH_PER_GRAPH(name, executor)  \
  BENCHMARK_CAPTURE(graph, name, executor) \
      ->RangeMultiplier(10)                \
      ->Range(10, 1000)                    \
      ->Unit(benchmark::kMillisecond)
HOTPATH_PER_GRAPH(fp_ro, "fp-ro");
HOTPATH_PER_GRAPH(edf_ro, "edf-ro");
HOTPATH_PER_GRAPH(default, "default");

}  // namespace
}  // namespace hotpath
