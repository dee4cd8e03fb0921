// SPDX-License-Identifier: Apache-2.0
// What an executor costs with real threads and the real clock. Here: the release of timers, as the authors of
// the paper measured it (their trace_timer_management_overhead.sh): delta per released timer and k per pass
// of the timer management thread, waiting for the lock left out.
#include <mutex>
#include <thread>

#include "hotpath/core/events_scheduler.hpp"
#include "hotpath/live/clock.hpp"
#include "microbench/bench_executor_live.hpp"
#include "microbench/counters.hpp"
#include "microbench/executor_run.hpp"
#include "microbench/program.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;
using gbench::Measurement;
using gbench::ns;

constexpr Worker kExecutor = EventsScheduler::kExecutor, kTimerManagement = EventsScheduler::kTimerManagement;

/// Another scheduler whose releases are timed.
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

 private:
  const std::unique_ptr<Scheduler> scheduler_;
  std::vector<double>& delta_;
};

/// The executor thread's side of a pass: sleeps, as Executor's workers do, until it is woken, and empties the
/// events queue.
class ParkedWorker {
 public:
  ParkedWorker(PiMutex& mutex, Scheduler& scheduler)
      : mutex_(mutex), scheduler_(scheduler), thread_([this] { work(); }) {}
  ~ParkedWorker() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    parker_.unpark();
    thread_.join();
  }

  /// Under the lock: whether it sleeps, and is ours to wake.
  bool claim() { return std::exchange(parked_, false); }
  void unpark() { parker_.unpark(); }

  void wait_until_parked() {
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (parked_) break;
      }
      std::this_thread::yield();
    }
    std::this_thread::sleep_for(20us);  // from the announcement into the sleep
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
      if (scheduler_.decide(kExecutor, Time{}).job) continue;
      const std::uint32_t ticket = parker_.ticket();
      parked_ = true;
      lock.unlock();
      parker_.park_until(ticket, kNever);
      lock.lock();
      parked_ = false;
    }
  }

  PiMutex& mutex_;
  Scheduler& scheduler_;
  Parker parker_;
  bool parked_ = false, stop_ = false;
  std::thread thread_;
};

/// Passes of the timer management thread, each with `due` timers due: its turn under the lock, and the
/// wake-up of a sleeping executor thread after it.
Measurement release_passes(const ExecutorEntry& entry, std::uint32_t due, bool wake, int passes) {
  TaskSet set = gbench::staggered_timers(due, 1ms);
  for (Task& t : set.tasks) t.phase = Duration{};
  std::vector<double> delta, k;
  delta.reserve(static_cast<std::size_t>(passes) * due);
  TimedReleases scheduler(entry.make(set, {}), delta);
  PiMutex mutex;
  Time virtual_now{};
  scheduler.begin(virtual_now);
  std::optional<ParkedWorker> worker;
  if (wake) worker.emplace(mutex, scheduler);
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
    while (!wake && scheduler.decide(kExecutor, virtual_now).job) {
    }
  }
  Measurement found;
  found.add_samples("delta", gbench::warm(std::move(delta)));
  found.add_samples("k", gbench::warm(std::move(k)));
  return found;
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
  const TaskSet set = gbench::staggered_timers(1, 1ms);
  std::vector<double> delta;
  delta.reserve(1'000'000);
  gbench::LiveRun live(set, std::make_unique<TimedReleases>(entry.make(set, {}), delta), handler,
                       default_options(entry), 1'000'000);
  live.run(length);
  Measurement found;
  found.add_samples("delta", gbench::warm(std::move(delta)));
  return found;
}

void register_all(bool quick) {
  const Duration length = quick ? 200ms : 1s;
  for (const char* name : {"events-ro", "rm-ro", "edf-ro"}) {
    const ExecutorEntry& e = *find_executor(name);
    for (const std::uint32_t due : {1U, 8U, 64U}) {
      for (const bool wake : {false, true}) {
        const int passes = (quick ? 1000 : 5000) * (wake ? 1 : 4);
        gbench::register_isolated("release_pass/" + std::string(name) + "/due:" + std::to_string(due) +
                                      "/wake:" + (wake ? "1" : "0"),
                                  [=, &e] { return release_passes(e, due, wake, passes); });
      }
    }
    for (const bool busy : {false, true}) {
      gbench::register_isolated("live_release/" + std::string(name) + "/executor:" + (busy ? "busy" : "idle"),
                                [=, &e] { return live_releases(e, busy, length); });
    }
  }
  gbench::register_live_benchmarks(quick);
}

}  // namespace

int main(int argc, char** argv) { return gbench::run_program(argc, argv, register_all); }
