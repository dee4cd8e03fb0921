// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "hotpath/reference_system/run_memory.hpp"
#include "microbench/measurement.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::microbench {

/// Sleeps until an absolute time, so that delays do not add up as with relative sleeps.
inline void sleep_until(Time instant) {
  const timespec t{to_ns(instant) / 1'000'000'000, to_ns(instant) % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

/// A bare loop of absolute sleeps: calls `tick` every `period` from `first` on, before `end`.
void every(Duration period, Time first, Time end, auto tick) {
  for (Time next = first; next < end; next += period) {
    sleep_until(next);
    tick(next);
  }
}

/// A handler whose jobs do nothing.
inline JobHandler& no_work() {
  static class NoWork final : public JobHandler {
    void run(const Job&, Time, Sample, Worker) override {}
  } handler;
  return handler;
}

/// A live executor and the memory of its records.
class LiveRun {
 public:
  LiveRun(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, JobHandler& handler,
          const ExecutorOptions& options, std::uint64_t records_per_worker = 100'000)
      : memory_({set.size(), static_cast<std::uint32_t>(scheduler->workers().size()), records_per_worker, 0}),
        executor_(set, std::move(scheduler), handler, memory_.jobs(), options) {}

  /// An executor with its defaults and jobs that do nothing.
  LiveRun(const TaskSet& set, const setup::ExecutorSpec& executor)
      : LiveRun(set, executor.entry->make(set, executor.scheduler), no_work(),
                default_options(*executor.entry)) {}

  Executor& executor() { return executor_; }

  /// Runs the executor for `length` from an epoch shortly after the call. Returns the CPU time of
  /// the process from the epoch to the end.
  Duration run(Duration length) {
    const Time epoch = now() + 20ms;
    warm_ = epoch + length / 10;
    executor_.start(epoch, epoch + length);
    std::this_thread::sleep_until(epoch);
    const Duration before = process_cpu_time();
    executor_.join();
    return process_cpu_time() - before;
  }

  /// `value` of every job that ran and started after the first tenth. Call it after run().
  template <class Value>
  std::vector<double> of_jobs(Value value) const {
    std::vector<double> values;
    for (const auto& log : memory_.jobs()) {
      for (const JobRecord& r : log.contents()) {
        if (r.outcome == Outcome::ran && r.start >= warm_) values.push_back(value(r));
      }
    }
    return values;
  }

  double jobs_run() const {
    std::uint64_t jobs = 0;
    for (const auto& log : memory_.jobs()) {
      for (const JobRecord& r : log.contents()) jobs += r.outcome == Outcome::ran ? 1 : 0;
      jobs += log.lost();
    }
    return static_cast<double>(jobs);
  }

 private:
  RunMemory memory_;
  Executor executor_;
  Time warm_{};
};

/// `n` subscriptions, each in a separate callback group.
inline TaskSet subscriptions(std::uint32_t n, std::uint32_t depth = 1) {
  TaskSet set;
  set.groups.assign(n, CallbackGroup::mutually_exclusive);
  for (std::uint32_t i = 0; i < n; ++i) {
    Task& t = set.tasks.emplace_back();
    t.name = "subscription" + std::to_string(i);
    t.kind = TaskKind::subscription;
    t.group = i;
    t.depth = depth;
  }
  return set;
}

}  // namespace hotpath::microbench
