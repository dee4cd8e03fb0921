// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/sample_rings.hpp"
#include "hotpath/core/trace.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/parker.hpp"
#include "hotpath/live/pi_mutex.hpp"
#include "hotpath/live/record_log.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath {

/// What jobs do.
class JobHandler {
 public:
  /// Runs one job, started at `start`, on the calling worker's thread and outside the executor's lock.
  /// `sample` is the sample that a subscription's job takes. May publish.
  virtual void run(const Job& job, Time start, Sample sample, Worker worker) = 0;

 protected:
  ~JobHandler() = default;
};

struct ExecutorOptions {
  ThreadPolicyRequest executor_threads;
  ThreadPolicyRequest timer_thread;
  bool measure_cpu_time = false;  ///< Thread CPU time of each job; about a microsecond a job.
  Worker first_worker = 0;        ///< Number of its first worker in records and for the handler.
};

/// The executor's defaults (design: Live execution): the paper's raise their timer management thread to
/// SCHED_FIFO 90 above the executor thread; the stock ones run under the ordinary policy.
[[nodiscard]] ExecutorOptions default_options(const ExecutorEntry& entry);

/// Threads, clock and what synchronises them: the system's. Tests put their own in its place, where they
/// decide which thread goes on.
struct SystemSync {
  using Mutex = PiMutex;
  using Parker = hotpath::Parker;
  using Thread = std::thread;
  using Latch = std::latch;
  static Time now() { return hotpath::now(); }
  /// Makes the calling thread ready for its role; see apply_thread_policy().
  static ThreadPolicy prepare_thread(WorkerRole role, const ThreadPolicyRequest& request);
};

/// Drives one scheduler with real threads and the real clock, one thread for each of the scheduler's workers.
/// Which of rclcpp's executors it is follows from the scheduler.
///
/// All workers share one lock, under which only the scheduler, the inbox of samples and the records of
/// arrivals are touched; jobs, publications and the return of samples happen outside of it.
template <class Sync>
class BasicExecutor final : public SampleSink {
 public:
  /// Logs for the records of one run: one for each worker, and one more for what arrivals overwrite.
  using Logs = std::vector<RecordLog<JobRecord>>;

  BasicExecutor(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, JobHandler& handler, Logs logs,
                const ExecutorOptions& options);
  ~BasicExecutor();

  /// Starts the threads; timers count from `epoch`, no job starts at or after `end`. Blocks until every
  /// thread has its policy; throws ThreadSetupError when a required one was refused.
  void start(Time epoch, Time end);

  /// Brings the end forward to now. Any thread.
  void stop();

  /// Waits for the threads, which finish the jobs they are in. Returns the instant at which the run ended.
  Time join();

  /// After join(): appends what was released or unread by `end` and did not start, and gives all samples
  /// back. `end` is that of the run, not before the one that join() returned. Samples that arrive later are
  /// neither kept nor recorded.
  void close(Time end);

  void deliver(TaskId task, const SampleInfo& info, Sample sample) override;

  /// Samples delivered to `task` so far. Any thread.
  [[nodiscard]] std::uint64_t arrived(TaskId task) const;

  /// One for each of the scheduler's workers; their policies are those obtained once start() has returned.
  [[nodiscard]] const std::vector<WorkerThread>& workers() const { return workers_; }

 private:
  struct Lane {
    typename Sync::Parker parker;
    bool parked = false;
    typename Sync::Thread thread;
  };
  void prepare(Worker worker);
  void work(Worker worker);
  void run_job(Worker worker, const Job& job, Sample sample);
  WorkerSet claim(WorkerSet wake);
  void unpark(WorkerSet claimed);

  const TaskSet set_;
  const std::unique_ptr<Scheduler> scheduler_;
  JobHandler& handler_;
  Logs logs_;
  const ExecutorOptions options_;

  mutable typename Sync::Mutex mutex_;
  Time epoch_{}, end_{kNever};
  bool closed_ = false;
  SampleRings<Sample> inbox_;  // the same samples as the scheduler's unread ones
  std::vector<std::uint64_t> arrived_;
  std::vector<Lane> lanes_;

  std::vector<WorkerThread> workers_;
  std::string setup_error_;
};

extern template class BasicExecutor<SystemSync>;
using Executor = BasicExecutor<SystemSync>;

}  // namespace hotpath
