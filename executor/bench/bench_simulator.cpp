// SPDX-License-Identifier: Apache-2.0
// Simulated jobs per second of one core, without trace: the paper's task set, and how the cost of one job
// grows with the number of tasks.
#include <benchmark/benchmark.h>

#include <string>

#include "hotpath/core/simulator.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;

Task timer(Duration period, Duration wcet, Duration phase) {
  Task t;
  t.period = t.deadline = period;
  t.phase = phase;
  t.wcet = t.bcet = wcet;
  return t;
}

/// Section VII-A at 90 %: two LiDARs, four cameras, one IMU.
TaskSet timers_only_90() {
  TaskSet set;
  for (int i = 0; i < 2; ++i) set.tasks.push_back(timer(200ms, 10ms, 200ms + i * 3ms));
  for (int i = 0; i < 4; ++i) set.tasks.push_back(timer(84ms, 16ms, 90ms + i * 3ms));
  set.tasks.push_back(timer(30ms, 1ms, 50ms));
  return set;
}

/// `n` timers of 20 periods between 10 and 1000 ms at 80 % of one core.
TaskSet timers(std::int64_t n) {
  TaskSet set;
  for (std::int64_t i = 0; i < n; ++i) {
    const Duration period = 10ms * (1 + (i * 7919) % 20 * 5);
    set.tasks.push_back(timer(period, period * 8 / (10 * n), period * i / n));
  }
  return set;
}

/// Simulates until the run is over, once per iteration; counts jobs.
void simulate_executor(benchmark::State& state, const TaskSet& set, const std::string& name,
                       Duration duration) {
  const ExecutorEntry& executor = *find_executor(name);
  SimulationOptions options;
  options.platform = default_platform(executor);
  options.duration = duration;
  const WorstCaseTimes times(set);
  std::uint64_t jobs = 0;
  for (auto _ : state) {
    PublishingWorkload workload(times);
    const auto scheduler = executor.make(set, {});
    jobs += simulate(set, *scheduler, workload, options).jobs;
  }
  state.counters["jobs/s"] = benchmark::Counter(static_cast<double>(jobs), benchmark::Counter::kIsRate);
  state.counters["s/job"] = benchmark::Counter(static_cast<double>(jobs),
                                               benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void timers_only_90(benchmark::State& state, const std::string& name) {
  simulate_executor(state, timers_only_90(), name, 600s);
}

void growing_set(benchmark::State& state, const std::string& name) {
  simulate_executor(state, timers(state.range(0)), name, 2s);
}

void register_all() {
  for (const ExecutorEntry& executor : executors()) {
    const std::string name(executor.name);
    benchmark::RegisterBenchmark(("timers_only_90/" + name).c_str(),
                                 [name](benchmark::State& s) { timers_only_90(s, name); });
  }
  for (const std::string name : {"rm-ro", "edf-ro", "rm-re", "events-ro"}) {
    benchmark::RegisterBenchmark(("tasks/" + name).c_str(),
                                 [name](benchmark::State& s) { growing_set(s, name); })
        ->RangeMultiplier(10)
        ->Range(10, 100'000)
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace

int main(int argc, char** argv) {
  register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
