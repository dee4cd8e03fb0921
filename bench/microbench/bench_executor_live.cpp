// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_executor_live.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "microbench/counters.hpp"
#include "microbench/executor_run.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::gbench {

namespace {

using namespace std::chrono_literals;

double since_release(const JobRecord& r) { return ns(r.start - r.job.release); }
double since_timestamp(const JobRecord& r) { return ns(r.start - r.job.timestamp); }

/// A timer every millisecond on an otherwise idle executor. Wait sets release when they poll, so that theirs
/// leaves the wake-up out: the lateness holds for all.
Measurement dispatch_timers(const ExecutorEntry& entry, Duration length) {
  const TaskSet set = staggered_timers(1, 1ms);
  NoWork handler;
  LiveRun live(set, entry.make(set, {}), handler, default_options(entry), 100'000);
  live.run(length);
  Measurement found;
  found.add_samples("release_to_start", live.of_jobs(since_release));
  found.add_samples("lateness", live.of_jobs(since_timestamp));
  return found;
}

/// Samples from another thread, one every millisecond, on an otherwise idle executor.
Measurement dispatch_samples(const ExecutorEntry& entry, Duration length) {
  const TaskSet set = subscriptions(1);
  NoWork handler;
  LiveRun live(set, entry.make(set, {}), handler, default_options(entry), 100'000);
  std::atomic<bool> stop = false;
  std::thread publisher([&] {
    minimise_timer_slack();
    for (Time next = now() + 30ms; !stop; next += 1ms) {
      sleep_until(next);
      live.executor().deliver(0, {now(), kNever, {}}, {});
    }
  });
  live.run(length);
  stop = true;
  publisher.join();
  Measurement found;
  found.add_samples("arrival_to_start", live.of_jobs(since_timestamp));
  return found;
}

/// The yardstick of that: a value from one thread to another with a condition variable.
Measurement hand_over(Duration length) {
  std::mutex mutex;
  std::condition_variable arrived;
  Time sent{};
  bool full = false, stop = false;
  std::vector<double> latencies;
  latencies.reserve(100'000);
  std::thread taker([&] {
    std::unique_lock lock(mutex);
    for (;;) {
      arrived.wait(lock, [&] { return full || stop; });
      if (stop) return;
      full = false;
      const Time sent_at = sent;
      lock.unlock();
      latencies.push_back(ns(now() - sent_at));
      lock.lock();
    }
  });
  minimise_timer_slack();
  const Time end = now() + length;
  for (Time next = now() + 1ms; next < end; next += 1ms) {
    sleep_until(next);
    {
      const std::lock_guard lock(mutex);
      sent = now();
      full = true;
    }
    arrived.notify_one();
  }
  {
    const std::lock_guard lock(mutex);
    stop = true;
  }
  arrived.notify_one();
  taker.join();
  Measurement found;
  found.add_samples("arrival_to_start", std::move(latencies));
  return found;
}

/// Lateness of a bare loop of absolute sleeps, in a thread with this policy and minimal timer slack.
std::vector<double> bare_sleeps(const std::string& policy, Duration length) {
  std::vector<double> late;
  late.reserve(100'000);
  std::thread sleeper([&] {
    minimise_timer_slack();
    static_cast<void>(apply_thread_policy({parse_thread_policy(policy), true}));
    const Time first = now() + 20ms;
    for (Time next = first; next < first + length; next += 1ms) {
      sleep_until(next);
      late.push_back(ns(now() - next));
    }
  });
  sleeper.join();
  return warm(std::move(late));
}

/// Lateness of the timer management thread's releases and of a bare loop, in turns.
Measurement wake_up(const std::string& policy, Duration length) {
  constexpr int kTurns = 4;
  const TaskSet set = staggered_timers(1, 1ms);
  NoWork handler;
  std::vector<double> executor, bare;
  for (int turn = 0; turn < kTurns; ++turn) {
    const std::vector<double> sleeps = bare_sleeps(policy, length / kTurns);
    bare.insert(bare.end(), sleeps.begin(), sleeps.end());
    LiveRun live(set, find_executor("rm-ro")->make(set, {}), handler, with_timer_policy(policy), 100'000);
    live.run(length / kTurns);
    const std::vector<double> releases =
        live.of_jobs([](const JobRecord& r) { return ns(r.job.release - r.job.timestamp); });
    executor.insert(executor.end(), releases.begin(), releases.end());
  }
  Measurement found;
  found.add_samples("wake_up", std::move(executor));
  const double median = found.time_ns;
  found.add_samples("bare_sleep", std::move(bare));
  for (const auto& [name, value] : found.counters) {
    if (name != "bare_sleep_p50_ns") continue;
    found.counters.emplace_back("ratio_to_bare_sleep", median / value);
    break;
  }
  return found;
}

/// Every job makes its own task ready again: as many jobs as there are tasks are ready at all times.
Measurement throughput(const ExecutorSpec& executor, std::uint32_t ready, Duration length) {
  class Refill final : public JobHandler {
   public:
    void run(const Job& job, Time start, Sample, Worker) override {
      sink->deliver(job.task, {start, start + 1ms, job.ref()}, {});
    }
    SampleSink* sink = nullptr;
  } handler;
  const TaskSet set = subscriptions(ready);
  LiveRun live(set, executor.entry->make(set, executor.scheduler), handler, default_options(*executor.entry),
               1000);
  handler.sink = &live.executor();
  for (TaskId id = 0; id < ready; ++id) live.executor().deliver(id, {now(), now(), {}}, {});
  const Time before = now();
  live.run(length);
  const Duration wall = now() - before;
  Measurement found;
  const auto jobs = static_cast<double>(live.jobs_run());
  found.time_ns = ns(wall) / jobs;
  found.counters = {{"jobs_per_s", jobs / ns(wall) * 1e9}};
  return found;
}

Measurement cpu_time_per(Duration cpu, double callbacks, Duration length) {
  Measurement found;
  found.time_ns = ns(cpu) / callbacks;
  found.counters = {{"cpu_per_callback_ns", found.time_ns}, {"cpu_percent", 100 * ns(cpu) / ns(length)}};
  return found;
}

/// CPU time of an executor whose ten timers do nothing.
Measurement timers_only(const ExecutorEntry& entry, int callbacks_per_s, Duration length) {
  const TaskSet set = staggered_timers(10, Duration(10s) / callbacks_per_s);
  NoWork handler;
  LiveRun live(set, entry.make(set, {}), handler, default_options(entry), 100'000);
  const Duration cpu = live.run(length);
  return cpu_time_per(cpu, static_cast<double>(live.jobs_run()), length);
}

Measurement bare_timer(int callbacks_per_s, Duration length) {
  const Duration before = process_cpu_time();
  const Time first = now();
  double wake_ups = 0;
  for (Time next = first; next < first + length; next += Duration(1s) / callbacks_per_s, ++wake_ups)
    sleep_until(next);
  return cpu_time_per(process_cpu_time() - before, wake_ups, length);
}

}  // namespace

void register_live_benchmarks(bool quick) {
  const Duration length = quick ? 200ms : 1s;
  for (const char* policy : {"other", "fifo:90"}) {
    register_isolated(std::string("wake_up/policy:") + policy, [=] { return wake_up(policy, 2 * length); });
  }
  register_isolated("dispatch_sample/condition_variable", [=] { return hand_over(length); });
  for (const int rate : {100, 1000}) {
    register_isolated("timers_only/bare_sleep/per_s:" + std::to_string(rate),
                      [=] { return bare_timer(rate, length); });
  }
  for (const std::string name : {"default", "static", "multi:1", "multi:2", "multi:4", "multi:8", "events-ro",
                                 "events-re", "rm-ro", "rm-re"}) {
    for (const std::uint32_t ready : {1U, 100U}) {
      register_isolated("throughput/" + name + "/ready:" + std::to_string(ready),
                        [=] { return throughput(parse_executor(name, {}), ready, length / 4); });
    }
  }
  for (const std::string name : {"default", "static", "multi", "events-ro", "events-re", "rm-ro", "rm-re"}) {
    const ExecutorEntry& e = *find_executor(name);
    register_isolated("dispatch_timer/" + name, [=, &e] { return dispatch_timers(e, length); });
    register_isolated("dispatch_sample/" + name, [=, &e] { return dispatch_samples(e, length); });
    for (const int rate : {100, 1000}) {
      register_isolated("timers_only/" + name + "/per_s:" + std::to_string(rate),
                        [=, &e] { return timers_only(e, rate, length); });
    }
  }
}

}  // namespace hotpath::gbench
