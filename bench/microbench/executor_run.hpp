// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/executor.hpp"

namespace hotpath::gbench {

/// Sleeps by the clock's absolute time, without the slack that a relative sleep may add up.
void sleep_until(Time instant);

/// A handler whose jobs do nothing.
class NoWork final : public JobHandler {
 public:
  void run(const Job&, Time, Sample, Worker) override {}
};

/// A live executor and the memory of its records.
class LiveRun {
 public:
  LiveRun(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, JobHandler& handler,
          const ExecutorOptions& options, std::uint64_t records_per_worker);

  Executor& executor() { return *executor_; }

  /// Starts it soon and waits until `length` later; returns the CPU time that the process used from the epoch
  /// to the end.
  Duration run(Duration length);

  /// `value` of every job that ran, without those that started in the first tenth of the run. After run().
  std::vector<double> of_jobs(const std::function<double(const JobRecord&)>& value) const;
  std::uint64_t jobs_run() const;

 private:
  std::unique_ptr<void, decltype(&std::free)> memory_{nullptr, std::free};
  Executor::Logs logs_;
  std::unique_ptr<Executor> executor_;
  Time warm_{};
};

/// `n` timers of one period, due one after another.
TaskSet staggered_timers(std::uint32_t n, Duration period);

/// `n` subscriptions, each in a separate callback group.
TaskSet subscriptions(std::uint32_t n, std::uint32_t depth = 1);

/// The executor's own defaults, with a timer thread at SCHED_FIFO 90 or an ordinary one where it has one.
/// Throws ThreadSetupError when that is not permitted.
ExecutorOptions with_timer_policy(const std::string& policy);

/// Nanoseconds from one instant to a later one.
inline double ns(Duration d) { return static_cast<double>(d.count()); }

}  // namespace hotpath::gbench
