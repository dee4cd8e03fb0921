// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <rclcpp/rclcpp.hpp>
#include <thread>
#include <vector>

#include "hotpath/live/thread_setup.hpp"
#include "hotpath/reference_system/typed_live_nodes.hpp"
#include "hotpath_rclcpp/priority_executor.hpp"
#include "transport.hpp"

namespace hotpath {

/// The nodes of a graph on rclcpp under one executor; used by RunLife like LiveSystem. Each
/// callback writes its job's record, so the executor's own work lies between the records.
class RclcppSystem : private SampleSink {
 public:
  /// `plan` is the runner's argument. Throws std::runtime_error, InputError.
  RclcppSystem(const Graph& graph, const GraphTasks& tasks, const nlohmann::json& plan, RunMemory& memory);
  /// Joins all threads, also after an error.
  ~RclcppSystem();
  RclcppSystem(const RclcppSystem&) = delete;
  RclcppSystem& operator=(const RclcppSystem&) = delete;

  void wait_until_matched(Time deadline) { nodes_->wait_until_matched(deadline); }
  /// Timers are first due at `epoch` plus their phases.
  void start(Time epoch, Time end);
  void stop();
  Time join();
  /// `end`: of the run; not before the instant that join() returned.
  void close(Time end);
  [[nodiscard]] std::uint64_t arrived(TaskId task) const { return tasks_of_run_[task].next; }
  [[nodiscard]] std::vector<WorkerThread> workers() const;

 private:
  /// Runs the executor; body of `thread_`.
  void spin();
  void end_spinning();
  /// Whether the executor's threads exist with their policies, or the executor has ended.
  [[nodiscard]] bool settled() const;
  struct OfTask {
    std::mutex mutex;
    std::uint64_t next = 0;  ///< Sequence of the next job.
    // Timers only. Their jobs overlap in a reentrant group; the number of timestamps that a job
    // skips is known when the next job starts.
    std::optional<std::uint64_t> newest;                     ///< Sequence of the latest started job.
    std::optional<JobRecord> last;                           ///< Its record, finished but not yet written.
    std::multimap<std::uint64_t, std::uint32_t> skipped_by;  ///< Skips of other running jobs, by sequence.
    rclcpp::TimerBase::SharedPtr timer;
    bool one_writer = true;
    /// Subscriptions under several threads: samples with an earlier number than a sample that came
    /// first. They were overwritten, unless another thread still delivers them.
    std::map<std::uint64_t, JobRecord> missing;
  };

  void deliver(TaskId task, const SampleInfo& info, Sample sample) override;
  /// Accounts for the samples between the last one and this, which the history overwrote. Call with
  /// the task's lock held.
  void count_sample(OfTask& subscription, const JobRecord& record);
  void add_timer(TaskId task);
  void run_timer(TaskId task, std::optional<Time> expected);
  /// Call with the task's lock held, in the thread that runs the job.
  void timer_starts(OfTask& timer, std::uint64_t sequence, Worker worker);
  void timer_finished(OfTask& timer, JobRecord& record);
  /// Sequence of the timer job that starts now.
  std::uint64_t timer_sequence(TaskId task, std::optional<Time> expected);
  void run(JobRecord& record, Sample sample);
  /// A log has one writer: `worker` belongs to the calling thread, which need not have run the job.
  void write(const JobRecord& record, Worker worker);
  Worker own_worker(bool timer);

  const GraphTasks tasks_;
  RunMemory& memory_;
  Executor::Logs logs_;
  const ExecutorEntry& entry_;
  RclcppTransport* transport_ = nullptr;  // owned by the nodes
  std::unique_ptr<LiveNodes> nodes_;
  std::deque<OfTask> tasks_of_run_;
  std::shared_ptr<rclcpp::Executor> executor_;
  const PriorityExecutor* ours_ = nullptr;  ///< The executor; null if it is rclcpp's.
  ThreadPolicyRequest policy_;              ///< For rclcpp's executors; the obtained policy once settled().
  const std::size_t executor_threads_;
  Time epoch_{};
  std::atomic<Time> end_{kNever};
  std::atomic<Worker> threads_{0};
  std::thread thread_;
  std::atomic_bool prepared_{false};  ///< rclcpp's executors: `policy_` is applied.
  std::atomic_bool ended_{false};
  std::exception_ptr error_;  ///< Valid once `ended_`.
};

}  // namespace hotpath
