// SPDX-License-Identifier: Apache-2.0
// Costs of an executor with the real clock: delta, the time to release one timer, as the authors of
// the paper measured it (their trace_timer_management_overhead.sh); the wake-up of the timer
// management thread; and the CPU time of a whole live executor.
#include <mutex>

#include "hotpath/core/events_scheduler.hpp"
#include "microbench/executor_run.hpp"
#include "program/text.hpp"

namespace hotpath::microbench {
namespace {

/// `n` timers of one period, due one after another.
TaskSet staggered_timers(std::uint32_t n, Duration period) {
  TaskSet set;
  for (std::uint32_t i = 0; i < n; ++i) {
    Task& t = set.tasks.emplace_back();
    t.name = "timer" + std::to_string(i);
    t.period = t.deadline = period;
    t.phase = period * i / n;
  }
  return set;
}

/// delta: passes of the timer management thread in which one timer is due, under the executor's
/// lock and without waiting for it.
Measurement release_passes(const ExecutorEntry& entry, int passes) {
  const TaskSet set = staggered_timers(1, 1ms);
  const std::unique_ptr<Scheduler> scheduler = entry.make(set, {});
  std::vector<double> delta;
  PiMutex mutex;
  Time virtual_now{};
  scheduler->begin(virtual_now);
  for (int i = 0; i < passes; ++i, virtual_now += 1ms) {
    {
      const std::lock_guard lock(mutex);
      const Time begin = now();
      const Effect effect = scheduler->release_timers(EventsScheduler::kTimerManagement, virtual_now);
      delta.push_back(ns(now() - begin) / effect.released);
      benchmark::DoNotOptimize(scheduler->decide(EventsScheduler::kTimerManagement, virtual_now));
    }
    while (scheduler->decide(EventsScheduler::kExecutor, virtual_now).job) {
    }
  }
  const double median = warm_median(std::move(delta));
  return {median, {{"delta_p50_ns", median}}};
}

/// Lateness of a bare loop of absolute sleeps, in a thread with this policy and minimal timer
/// slack.
std::vector<double> bare_sleeps(const std::string& policy, Duration length) {
  std::vector<double> late;
  late.reserve(100'000);
  std::thread sleeper([&] {
    minimise_timer_slack();
    static_cast<void>(apply_thread_policy({parse_thread_policy(policy), true}));
    const Time first = now() + 20ms;
    for (Time next = first; next < first + length; next += 1ms) {
      sleep_until(next);
      if (next >= first + length / 10) late.push_back(ns(now() - next));
    }
  });
  sleeper.join();
  return late;
}

/// Lateness of the timer management thread's releases and of a bare loop, measured in turns.
Measurement wake_up(const std::string& policy, Duration length) {
  constexpr int kTurns = 4;
  ExecutorOptions options;
  options.timer_thread = {parse_thread_policy(policy), true};  // must be permitted
  const TaskSet set = staggered_timers(1, 1ms);
  std::vector<double> executor, bare;
  for (int turn = 0; turn < kTurns; ++turn) {
    const std::vector<double> sleeps = bare_sleeps(policy, length / kTurns);
    bare.insert(bare.end(), sleeps.begin(), sleeps.end());
    LiveRun live(set, setup::parse_executor("rm-ro", {}), options);
    live.run(length / kTurns);
    const std::vector<double> releases =
        live.of_jobs([](const JobRecord& r) { return ns(r.job.release - r.job.timestamp); });
    executor.insert(executor.end(), releases.begin(), releases.end());
  }
  const double released = warm_median(std::move(executor), 0), slept = warm_median(std::move(bare), 0);
  return {released,
          {{"wake_up_p50_ns", released},
           {"bare_sleep_p50_ns", slept},
           {"ratio_to_bare_sleep", released / slept}}};
}

/// CPU time of an executor with ten timers whose jobs do nothing, 1000 callbacks a second.
Measurement timers_only(const setup::ExecutorSpec& executor, Duration length) {
  const TaskSet set = staggered_timers(10, 10ms);
  LiveRun live(set, executor, default_options(*executor.entry));
  const Duration cpu = live.run(length);
  const double each = ns(cpu) / live.jobs_run();
  return {each, {{"cpu_per_callback_ns", each}}};
}

}  // namespace

void register_all(bool quick) {
  const Duration length = quick ? 200ms : 1s;
  for (const char* name : {"rm-ro", "edf-ro"}) {
    const ExecutorEntry& entry = *find_executor(name);
    register_isolated(program::concat("release_pass/", name, "/due:1/wake:0"),
                      [=, &entry] { return release_passes(entry, quick ? 4000 : 20'000); });
  }
  for (const char* policy : {"other", "fifo:90"}) {
    register_isolated(program::concat("wake_up/policy:", policy),
                      [=] { return wake_up(policy, 2 * length); });
  }
  for (const char* name : {"cbg:1", "events-ro"}) {
    register_isolated(program::concat("timers_only/", name, "/per_s:1000"),
                      [=] { return timers_only(setup::parse_executor(name, {}), length); });
  }
}

}  // namespace hotpath::microbench
