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

/// Runs the jobs of an executor.
class JobHandler {
 public:
  /// Runs one job, started at `start`, on the calling worker's thread, outside the executor's lock.
  /// `sample` is the sample that a subscription's job takes. May publish.
  virtual void run(const Job& job, Time start, Sample sample, Worker worker) = 0;

 protected:
  ~JobHandler() = default;
};

/// Parameters of a live executor.
struct ExecutorOptions {
  ThreadPolicyRequest executor_threads;
  ThreadPolicyRequest timer_thread;
  bool measure_cpu_time = false;  ///< Measures each job's thread CPU time; costs about a microsecond per job.
  Worker first_worker = 0;        ///< Number of the first worker in records and for the handler.
};

/// The executor's default thread policies: the paper's executors raise their timer management
/// thread to SCHED_FIFO 90 above the executor thread; the stock executors use the ordinary policy.
[[nodiscard]] ExecutorOptions default_options(const ExecutorEntry& entry);

/// The threads, clock and synchronisation primitives of the system. Tests substitute their own,
/// which control the interleaving of the threads.
struct SystemSync {
  using Mutex = PiMutex;
  using Parker = hotpath::Parker;
  using Thread = std::thread;
  using Latch = std::latch;
  static Time now() { return hotpath::now(); }
  /// Prepares the calling thread for its role; see apply_thread_policy().
  static ThreadPolicy prepare_thread(WorkerRole role, const ThreadPolicyRequest& request);
};

/// Drives one scheduler with real threads and the real clock, one thread per worker of the
/// scheduler. The scheduler determines which of rclcpp's executors this is.
///
/// All workers share one lock. It protects the scheduler, the inbox of samples and the records of
/// arrivals; jobs, publications and the return of samples happen outside the lock.
template <class Sync>
class BasicExecutor final : public SampleSink {
 public:
  /// The logs for one run's records: one per worker, and one more for samples overwritten at
  /// arrival.
  using Logs = std::vector<RecordLog<JobRecord>>;

  BasicExecutor(const TaskSet& set, std::unique_ptr<Scheduler> scheduler, JobHandler& handler, Logs logs,
                const ExecutorOptions& options);
  ~BasicExecutor();

  /// Starts the threads; timers count from `epoch`, and no job starts at or after `end`. Blocks
  /// until every thread has its policy. Throws ThreadSetupError if a required policy was refused.
  void start(Time epoch, Time end);

  /// Brings the end forward to now. Callable from any thread.
  void stop();

  /// Waits for the threads, which finish the jobs they are in. Returns the instant at which the run ended.
  Time join();

  /// After join(): records the jobs that were released or unread by `end` and did not start, and
  /// returns all samples to their owners. `end` is the end of the run, not before the instant that
  /// join() returned. Samples that arrive later are neither kept nor recorded.
  void close(Time end);

  void deliver(TaskId task, const SampleInfo& info, Sample sample) override;

  /// Number of samples delivered to `task` so far. Callable from any thread.
  [[nodiscard]] std::uint64_t arrived(TaskId task) const;

  /// One entry per worker of the scheduler; after start() with the policies obtained.
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
  SampleRings<Sample> inbox_;  // matches the scheduler's unread samples
  std::vector<std::uint64_t> arrived_;
  std::vector<Lane> lanes_;

  std::vector<WorkerThread> workers_;
  std::string setup_error_;
};

extern template class BasicExecutor<SystemSync>;
using Executor = BasicExecutor<SystemSync>;

}  // namespace hotpath
