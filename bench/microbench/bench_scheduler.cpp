// SPDX-License-Identifier: Apache-2.0
// What the scheduling core costs without any thread: release, decision and finish of one job against the
// number of tasks and of ready jobs, with bare containers as yardsticks in the same program.
#include <algorithm>
#include <array>
#include <string>

#include "hotpath/analysis/statistics.hpp"
#include "microbench/bench_queues.hpp"
#include "microbench/program.hpp"
#include "microbench/scheduler_cycles.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using gbench::SampleCycle;
using gbench::TimerCycle;

/// Jobs of one timed block: so many that reading the clock does not count, so few that the ready queue hardly
/// changes.
constexpr std::int64_t kBlock = 50;

std::int64_t block_of(std::int64_t tasks) { return std::min(kBlock, tasks / 2); }

enum class Ready { empty, hundred, full };

std::int64_t ready_jobs(Ready ready, std::int64_t tasks) {
  switch (ready) {
    case Ready::empty:
      return 0;
    case Ready::hundred:
      return 100;
    case Ready::full:
      return tasks - block_of(tasks);
  }
  return 0;
}

/// Time of one operation: the median over blocks, which an interruption of one block does not change.
class BlockTimes {
 public:
  explicit BlockTimes(std::int64_t block) : block_(block) { per_job_ns_.reserve(kKept); }
  void add(Clock::duration d) {
    if (per_job_ns_.size() < kKept) {
      per_job_ns_.push_back(static_cast<double>(Duration(d).count()) / static_cast<double>(block_));
    }
  }
  double median() { return quantiles(std::move(per_job_ns_)).p50; }

 private:
  static constexpr std::size_t kKept = 100'000;
  const std::int64_t block_;
  std::vector<double> per_job_ns_;
};

/// Time: release, decision and finish of one job, the mean. Counters: each of them.
template <class Cycle>
void cycle(benchmark::State& state, const ExecutorEntry& executor, Ready ready) {
  const std::int64_t tasks = state.range(0), block = block_of(tasks);
  Cycle jobs(executor, tasks, ready_jobs(ready, tasks));
  std::array<Job, kBlock> running;
  BlockTimes release(block), decide(block), finish(block);
  while (state.KeepRunningBatch(block)) {
    jobs.prepare(block);
    const Clock::time_point t0 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) jobs.release();
    const Clock::time_point t1 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) running[static_cast<std::size_t>(i)] = *jobs.decide().job;
    const Clock::time_point t2 = Clock::now();
    for (std::int64_t i = 0; i < block; ++i) jobs.finish(running[static_cast<std::size_t>(i)]);
    const Clock::time_point t3 = Clock::now();
    release.add(t1 - t0);
    decide.add(t2 - t1);
    finish.add(t3 - t2);
    state.SetIterationTime(std::chrono::duration<double>(t3 - t0).count());
  }
  state.counters["release_ns"] = release.median();
  state.counters["decide_ns"] = decide.median();
  state.counters["finish_ns"] = finish.median();
  state.SetComplexityN(tasks);
}

/// All timers due at once: released and decided to the last.
void drain(benchmark::State& state, const ExecutorEntry& executor) {
  TaskSet set = gbench::task_set(state.range(0), TaskKind::timer);
  for (Task& t : set.tasks) t.phase = 0us;
  const Duration period = set.tasks.front().period;
  const auto scheduler = executor.make(set, {});
  const Worker releaser = static_cast<Worker>(scheduler->workers().size() - 1);
  const Worker worker = executor.traits.timer_worker();
  Time now{};
  scheduler->begin(now);
  for (auto _ : state) {
    while (scheduler->release_timers(releaser, now).released > 0) {
    }
    while (const auto job = scheduler->decide(worker, now).job) {
      benchmark::DoNotOptimize(scheduler->finished(worker, *job, now));
    }
    now += period;
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.SetComplexityN(state.range(0));
}

void register_all(bool quick) {
  const std::int64_t most = quick ? 10'000 : 100'000;
  const double min_time = quick ? 0.01 : 0.05;
  const auto grow = [&](benchmark::internal::Benchmark* b, std::int64_t least, std::int64_t largest) {
    b->RangeMultiplier(10)->Range(least, largest)->MinTime(min_time)->Complexity();
    return b;
  };
  // dm and fp differ from rm in the table of priorities alone.
  const std::array timers = {"default", "static", "multi", "events-ro", "events-re",
                             "rm-ro",   "rm-re",  "fp-ro", "edf-ro",    "edf-re"};
  // Release-only and release-and-execute treat samples alike.
  const std::array samples = {"default", "static", "multi", "events-ro", "fp-ro", "edf-ro"};
  const std::array levels = {std::pair{"empty", Ready::empty}, std::pair{"100", Ready::hundred},
                             std::pair{"full", Ready::full}};
  const auto add_cycles = [&]<class Cycle>(const std::string& kind, const auto& names) {
    for (const auto& [level_name, level] : levels) {
      for (const char* name : names) {
        const std::string benchmark = kind + "/" + name + "/ready:" + level_name + "/tasks";
        grow(benchmark::RegisterBenchmark(benchmark.c_str(), cycle<Cycle>, std::ref(*find_executor(name)),
                                          level),
             level == Ready::hundred ? 1000 : 10, most)
            ->UseManualTime();
      }
    }
  };
  add_cycles.operator()<TimerCycle>("timer_cycle", timers);
  add_cycles.operator()<SampleCycle>("sample_cycle", samples);
  for (const char* name : timers) {
    const ExecutorEntry& e = *find_executor(name);
    // The wait sets erase from the front of their snapshot: quadratic, so their largest set would take a
    // minute.
    const bool wait_set = e.traits.family == Family::wait_set;
    grow(benchmark::RegisterBenchmark(("drain/" + std::string(name) + "/tasks").c_str(),
                                      [&e](benchmark::State& s) { drain(s, e); }),
         100, wait_set ? std::min<std::int64_t>(most, 10'000) : most)
        ->Unit(benchmark::kMicrosecond);
  }
  gbench::register_queues(most, min_time);
}

}  // namespace

int main(int argc, char** argv) { return gbench::run_program(argc, argv, register_all); }
