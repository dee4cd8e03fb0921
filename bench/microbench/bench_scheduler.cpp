// SPDX-License-Identifier: Apache-2.0
// Costs of the scheduling core without threads: release, decision and finish of one job by number of tasks
// and of ready jobs, with bare containers as yardsticks in the same program.
#include <algorithm>
#include <array>
#include <string>

#include "hotpath/live/clock.hpp"
#include "microbench/measurement.hpp"
#include "microbench/scheduler_cycles.hpp"

namespace hotpath::microbench {
namespace {

/// Jobs of one timed block: enough to hide the cost of reading the clock, and few enough to hardly
/// change the ready queue.
constexpr std::int64_t kBlock = 50;

/// Time: mean of release, decision and finish of one job. Counters: the median of each over blocks,
/// which is robust against the interruption of a block. `ready` jobs wait all the time, limited by
/// the number of tasks.
template <class Cycle>
void cycle(benchmark::State& state, const ExecutorEntry& executor, std::int64_t ready) {
  const std::int64_t tasks = state.range(0), block = std::min(kBlock, tasks / 2);
  Cycle jobs(executor, tasks, std::min(ready, tasks - block));
  std::array<Job, kBlock> running;
  const auto active = std::span(running).first(static_cast<std::size_t>(block));
  constexpr std::size_t kKept = 100'000;
  std::array<std::vector<double>, 3> per_job_ns;
  for (auto& samples : per_job_ns) samples.reserve(kKept);
  while (state.KeepRunningBatch(block)) {
    jobs.prepare(block);
    const Time t0 = now();
    for (std::int64_t i = 0; i < block; ++i) jobs.release();
    const Time t1 = now();
    for (Job& job : active) job = *jobs.decide().job;
    const Time t2 = now();
    for (const Job& job : active) jobs.finish(job);
    const Time t3 = now();
    const std::array spent = {t1 - t0, t2 - t1, t3 - t2};
    for (std::size_t i = 0; i < spent.size() && per_job_ns[i].size() < kKept; ++i) {
      per_job_ns[i].push_back(ns(spent[i]) / static_cast<double>(block));
    }
    state.SetIterationTime(std::chrono::duration<double>(t3 - t0).count());
  }
  state.counters["release_ns"] = quantiles(per_job_ns[0]).p50;
  state.counters["decide_ns"] = quantiles(per_job_ns[1]).p50;
  state.counters["finish_ns"] = quantiles(per_job_ns[2]).p50;
  state.SetComplexityN(tasks);
}

/// All timers are due at once: releases and decides all jobs.
void drain(benchmark::State& state, const ExecutorEntry& executor) {
  TaskSet set = task_set(state.range(0), TaskKind::timer);
  for (Task& t : set.tasks) t.phase = 0us;
  const Duration period = set.tasks.front().period;
  const auto scheduler = executor.make(set, {});
  const Worker releaser = static_cast<Worker>(scheduler->workers().size() - 1);
  const Worker worker = executor.traits.timer_worker();
  Time at{};
  scheduler->begin(at);
  for (auto _ : state) {
    while (scheduler->release_timers(releaser, at).released > 0) {
    }
    while (const auto job = scheduler->decide(worker, at).job) {
      benchmark::DoNotOptimize(scheduler->finished(worker, *job, at));
    }
    at += period;
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.SetComplexityN(state.range(0));
}

}  // namespace

void register_all(bool quick) {
  const std::int64_t most = quick ? 10'000 : 100'000;
  const double min_time = quick ? 0.01 : 0.05;
  const auto grow = [&](benchmark::internal::Benchmark* b, std::int64_t least, std::int64_t largest) {
    return b->RangeMultiplier(10)->Range(least, largest)->MinTime(min_time)->Complexity();
  };
  // dm and fp differ from rm only in the table of priorities.
  const std::array timers = {"default", "static", "multi", "cbg",    "events-ro", "events-re",
                             "rm-ro",   "rm-re",  "fp-ro", "edf-ro", "edf-re"};
  // Release-only and release-and-execute treat samples alike.
  const std::array samples = {"default", "static", "multi", "cbg", "events-ro", "fp-ro", "edf-ro"};
  const std::array levels = {std::pair{"empty", std::int64_t{0}}, std::pair{"100", std::int64_t{100}},
                             std::pair{"full", most}};
  const auto add_cycles = [&]<class Cycle>(const std::string& kind, const auto& names) {
    for (const auto& [level_name, level] : levels) {
      for (const char* name : names) {
        const std::string benchmark = kind + "/" + name + "/ready:" + level_name + "/tasks";
        grow(benchmark::RegisterBenchmark(benchmark.c_str(), cycle<Cycle>, std::ref(*find_executor(name)),
                                          level),
             level == 100 ? 1000 : 10, most)
            ->UseManualTime();
      }
    }
  };
  add_cycles.operator()<TimerCycle>("timer_cycle", timers);
  add_cycles.operator()<SampleCycle>("sample_cycle", samples);
  for (const char* name : timers) {
    const ExecutorEntry& e = *find_executor(name);
    // Wait sets erase from the front of their snapshot, which is quadratic: the largest set would
    // take a minute.
    const bool wait_set = e.traits.family == Family::wait_set;
    grow(benchmark::RegisterBenchmark(("drain/" + std::string(name) + "/tasks").c_str(),
                                      [&e](benchmark::State& s) { drain(s, e); }),
         100, wait_set ? std::min<std::int64_t>(most, 10'000) : most)
        ->Unit(benchmark::kMicrosecond);
  }
  register_queues(most, min_time);
}

}  // namespace hotpath::microbench
