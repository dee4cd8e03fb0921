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

/// A live executor whose jobs do nothing, and the memory of its records.
class LiveRun {
 public:
  LiveRun(const TaskSet& set, const setup::ExecutorSpec& executor, const ExecutorOptions& options,
          std::uint64_t records_per_worker = 100'000)
      : LiveRun(set, executor.entry->make(set, executor.scheduler), options, records_per_worker) {}

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
  struct NoWork final : JobHandler {
    void run(const Job&, Time, Sample, Worker) override {}
  };

  LiveRun(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, const ExecutorOptions& options,
          std::uint64_t records_per_worker)
      : memory_({set.size(), static_cast<std::uint32_t>(scheduler->workers().size()), records_per_worker, 0}),
        executor_(set, std::move(scheduler), no_work_, memory_.jobs(), options) {}

  NoWork no_work_;
  RunMemory memory_;
  Executor executor_;
  Time warm_{};
};

}  // namespace hotpath::microbench
