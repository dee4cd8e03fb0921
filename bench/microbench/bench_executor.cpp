// SPDX-License-Identifier: Apache-2.0
// Costs of an executor with real threads and the real clock. First the release of timers, measured as by the
// authors of the paper (their trace_timer_management_overhead.sh): delta per released timer and k per pass of
// the timer management thread, without waiting for the lock. Then dispatch latency, wake-up latency,
// throughput and CPU time of whole live executors.
#include <atomic>
#include <condition_variable>
#include <mutex>

#include "hotpath/core/events_scheduler.hpp"
#include "microbench/executor_run.hpp"
#include "program/text.hpp"

namespace hotpath::microbench {
namespace {

constexpr Worker kExecutor = EventsScheduler::kExecutor, kTimerManagement = EventsScheduler::kTimerManagement;

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

/// Wraps a scheduler and times its releases.
class TimedReleases final : public Scheduler {
 public:
  explicit TimedReleases(std::unique_ptr<Scheduler> scheduler, std::vector<double>& delta)
      : scheduler_(std::move(scheduler)), delta_(delta) {}

  std::span<const WorkerRole> workers() const override { return scheduler_->workers(); }
  void begin(Time epoch) override { scheduler_->begin(epoch); }
  Effect release_timers(Worker worker, Time at) override {
    const Time entry = now();
    const Effect effect = scheduler_->release_timers(worker, at);
    const Time exit = now();
    if (effect.released > 0 && delta_.size() < delta_.capacity()) {
      delta_.push_back(ns(exit - entry) / effect.released);
    }
    return effect;
  }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time at) override {
    return scheduler_->sample_arrived(task, sample, at);
  }
  Decision decide(Worker worker, Time at) override { return scheduler_->decide(worker, at); }
  Effect finished(Worker worker, const Job& job, Time at) override {
    return scheduler_->finished(worker, job, at);
  }
  std::uint32_t unread(TaskId task) const override { return scheduler_->unread(task); }
  void unfinished(Time at, const Visitor& visit) const override { scheduler_->unfinished(at, visit); }
  Joined add_task(const JoiningTask& joining, Time at) override { return scheduler_->add_task(joining, at); }
  void remove_task(TaskId task, Time at, const Visitor& dropped) override {
    scheduler_->remove_task(task, at, dropped);
  }

 private:
  const std::unique_ptr<Scheduler> scheduler_;
  std::vector<double>& delta_;
};

/// The executor thread during a pass: like Executor's workers, it sleeps until it is woken.
class ParkedWorker {
 public:
  ~ParkedWorker() {
    stop_ = true;
    parker_.unpark();
    thread_.join();
  }

  /// Whether it sleeps; if so, the caller must wake it.
  bool claim() { return parked_.exchange(false); }
  void unpark() { parker_.unpark(); }

  void wait_until_parked() const {
    while (!parked_) std::this_thread::yield();
    std::this_thread::sleep_for(20us);  // from the announcement into the sleep
  }

 private:
  void work() {
    while (!stop_) {
      const std::uint32_t ticket = parker_.ticket();
      parked_ = true;
      parker_.park_until(ticket, kNever);
    }
  }

  Parker parker_;
  std::atomic<bool> parked_ = false, stop_ = false;
  std::thread thread_{[this] { work(); }};
};

/// Passes of the timer management thread with `due` timers each: its turn under the lock, then the
/// wake-up of a sleeping executor thread.
Measurement release_passes(const ExecutorEntry& entry, std::uint32_t due, bool wake, int passes) {
  TaskSet set = staggered_timers(due, 1ms);
  for (Task& t : set.tasks) t.phase = Duration{};
  std::vector<double> delta, k;
  delta.reserve(static_cast<std::size_t>(passes) * due);
  TimedReleases scheduler(entry.make(set, {}), delta);
  PiMutex mutex;
  Time virtual_now{};
  scheduler.begin(virtual_now);
  std::optional<ParkedWorker> worker;
  if (wake) worker.emplace();
  for (int i = 0; i < passes; ++i, virtual_now += 1ms) {
    if (wake) worker->wait_until_parked();
    std::uint32_t released = 0;
    // The stock executor releases one timer at a time.
    while (released < due) {
      const Time begin = now();
      std::unique_lock lock(mutex);
      benchmark::DoNotOptimize(now());
      const Turn turn = take_turn(scheduler, kTimerManagement, virtual_now);
      const bool claimed = wake && turn.decision.wake.contains(kExecutor) && worker->claim();
      lock.unlock();
      if (claimed) worker->unpark();
      k.push_back(ns(now() - begin) - delta.back() * turn.released);
      released += turn.released;
    }
    while (scheduler.decide(kExecutor, virtual_now).job) {
    }
  }
  return Measurement{}.add_samples("delta", warm(std::move(delta))).add_samples("k", warm(std::move(k)));
}

/// delta in a running executor, whose timer management thread sleeps between two passes.
Measurement live_releases(const ExecutorEntry& entry, bool executor_busy, Duration length) {
  class Busy final : public JobHandler {
   public:
    explicit Busy(bool busy) : busy_(busy) {}
    void run(const Job&, Time start, Sample, Worker) override {
      // Longer than the period: the executor thread never sleeps again.
      while (busy_ && now() < start + 1100us) {
      }
    }

   private:
    const bool busy_;
  } handler(executor_busy);
  const TaskSet set = staggered_timers(1, 1ms);
  std::vector<double> delta;
  delta.reserve(1'000'000);
  LiveRun live(set, std::make_unique<TimedReleases>(entry.make(set, {}), delta), handler,
               default_options(entry), 1'000'000);
  live.run(length);
  return Measurement{}.add_samples("delta", warm(std::move(delta)));
}

double since_release(const JobRecord& r) { return ns(r.start - r.job.release); }
double since_timestamp(const JobRecord& r) { return ns(r.start - r.job.timestamp); }

/// A timer every millisecond on an otherwise idle executor. Wait sets release when they poll, so
/// that their release_to_start excludes the wake-up; compare executors by their lateness.
Measurement dispatch_timers(const setup::ExecutorSpec& executor, Duration length) {
  LiveRun live(staggered_timers(1, 1ms), executor);
  live.run(length);
  return Measurement{}
      .add_samples("release_to_start", live.of_jobs(since_release))
      .add_samples("lateness", live.of_jobs(since_timestamp));
}

/// Samples from another thread, one every millisecond, on an otherwise idle executor.
Measurement dispatch_samples(const setup::ExecutorSpec& executor, Duration length) {
  LiveRun live(subscriptions(1), executor);
  std::thread publisher([&] {
    minimise_timer_slack();
    every(1ms, now() + 30ms, now() + 20ms + length, [&](Time) {
      live.executor().deliver(0, {now(), kNever, {}}, {});
    });
  });
  live.run(length);
  publisher.join();
  return Measurement{}.add_samples("arrival_to_start", live.of_jobs(since_timestamp));
}

/// Yardstick of dispatch_samples(): a value from one thread to another with a condition variable.
Measurement hand_over(Duration length) {
  std::mutex mutex;
  std::condition_variable arrived;
  Time sent{};  // epoch: the value was taken; kNever: no more values follow
  std::vector<double> latencies;
  latencies.reserve(100'000);
  std::thread taker([&] {
    std::unique_lock lock(mutex);
    for (;;) {
      arrived.wait(lock, [&] { return sent != Time{}; });
      const Time sent_at = std::exchange(sent, Time{});
      if (sent_at == kNever) return;
      lock.unlock();
      latencies.push_back(ns(now() - sent_at));
      lock.lock();
    }
  });
  const auto send = [&](bool last) {
    {
      const std::lock_guard lock(mutex);
      sent = last ? kNever : now();
    }
    arrived.notify_one();
  };
  minimise_timer_slack();
  every(1ms, now() + 1ms, now() + length, [&](Time) { send(false); });
  send(true);
  taker.join();
  return Measurement{}.add_samples("arrival_to_start", std::move(latencies));
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
    every(1ms, first, first + length, [&](Time due) { late.push_back(ns(now() - due)); });
  });
  sleeper.join();
  return warm(std::move(late));
}

/// Default options with this policy for the timer thread, which must be permitted.
ExecutorOptions with_timer_policy(const std::string& policy) {
  ExecutorOptions options;
  options.timer_thread = {parse_thread_policy(policy), true};
  return options;
}

/// Lateness of the timer management thread's releases and of a bare loop, measured in turns.
Measurement wake_up(const std::string& policy, Duration length) {
  constexpr int kTurns = 4;
  const TaskSet set = staggered_timers(1, 1ms);
  std::vector<double> executor, bare;
  for (int turn = 0; turn < kTurns; ++turn) {
    const std::vector<double> sleeps = bare_sleeps(policy, length / kTurns);
    bare.insert(bare.end(), sleeps.begin(), sleeps.end());
    LiveRun live(set, find_executor("rm-ro")->make(set, {}), no_work(), with_timer_policy(policy));
    live.run(length / kTurns);
    const std::vector<double> releases =
        live.of_jobs([](const JobRecord& r) { return ns(r.job.release - r.job.timestamp); });
    executor.insert(executor.end(), releases.begin(), releases.end());
  }
  Measurement found;
  found.add_samples("wake_up", std::move(executor));
  found.add_samples("bare_sleep", std::move(bare));
  found.counters["ratio_to_bare_sleep"] =
      found.counters["wake_up_p50_ns"] / found.counters["bare_sleep_p50_ns"];
  return found;
}

/// Every job makes its own task ready again, so that all `ready` tasks always have a job.
Measurement throughput(const setup::ExecutorSpec& executor, std::uint32_t ready, Duration length) {
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
  const double jobs = live.jobs_run();
  return {ns(wall) / jobs, {{"jobs_per_s", jobs / ns(wall) * 1e9}}};
}

Measurement cpu_time_per(Duration cpu, double callbacks, Duration length) {
  const double each = ns(cpu) / callbacks;
  return {each, {{"cpu_per_callback_ns", each}, {"cpu_percent", 100 * ns(cpu) / ns(length)}}};
}

/// CPU time of an executor with ten timers whose jobs do nothing.
Measurement timers_only(const setup::ExecutorSpec& executor, int callbacks_per_s, Duration length) {
  const TaskSet set = staggered_timers(10, Duration(10s) / callbacks_per_s);
  LiveRun live(set, executor);
  const Duration cpu = live.run(length);
  return cpu_time_per(cpu, live.jobs_run(), length);
}

Measurement bare_timer(int callbacks_per_s, Duration length) {
  const Duration before = process_cpu_time();
  double wake_ups = 0;
  every(Duration(1s) / callbacks_per_s, now(), now() + length, [&](Time) { ++wake_ups; });
  return cpu_time_per(process_cpu_time() - before, wake_ups, length);
}

void register_release_benchmarks(bool quick) {
  const Duration length = quick ? 200ms : 1s;
  for (const char* name : {"events-ro", "rm-ro", "edf-ro"}) {
    const ExecutorEntry& e = *find_executor(name);
    for (const std::uint32_t due : {1U, 8U, 64U}) {
      for (const bool wake : {false, true}) {
        const int passes = (quick ? 1000 : 5000) * (wake ? 1 : 4);
        register_isolated(program::concat("release_pass/", name, "/due:", due, "/wake:", wake),
                          [=, &e] { return release_passes(e, due, wake, passes); });
      }
    }
    for (const bool busy : {false, true}) {
      register_isolated(program::concat("live_release/", name, "/executor:", busy ? "busy" : "idle"),
                        [=, &e] { return live_releases(e, busy, length); });
    }
  }
}

}  // namespace

void register_all(bool quick) {
  register_release_benchmarks(quick);
  const Duration length = quick ? 200ms : 1s;
  for (const char* policy : {"other", "fifo:90"}) {
    register_isolated(program::concat("wake_up/policy:", policy),
                      [=] { return wake_up(policy, 2 * length); });
  }
  register_isolated("dispatch_sample/condition_variable", [=] { return hand_over(length); });
  for (const int rate : {100, 1000}) {
    register_isolated(program::concat("timers_only/bare_sleep/per_s:", rate),
                      [=] { return bare_timer(rate, length); });
  }
  for (const std::string name : {"default", "static", "multi:1", "multi:2", "multi:4", "multi:8", "cbg:1",
                                 "events-ro", "events-re", "rm-ro", "rm-re"}) {
    for (const std::uint32_t ready : {1U, 100U}) {
      register_isolated(program::concat("throughput/", name, "/ready:", ready),
                        [=] { return throughput(setup::parse_executor(name, {}), ready, length / 4); });
    }
  }
  for (const std::string name :
       {"default", "static", "multi", "cbg:1", "events-ro", "events-re", "rm-ro", "rm-re"}) {
    const setup::ExecutorSpec e = setup::parse_executor(name, {});
    register_isolated("dispatch_timer/" + name, [=] { return dispatch_timers(e, length); });
    register_isolated("dispatch_sample/" + name, [=] { return dispatch_samples(e, length); });
    for (const int rate : {100, 1000}) {
      register_isolated(program::concat("timers_only/", name, "/per_s:", rate),
                        [=] { return timers_only(e, rate, length); });
    }
  }
}

}  // namespace hotpath::microbench
