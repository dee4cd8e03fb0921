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

/// The nodes of a graph on rclcpp under one executor; as LiveSystem, for RunLife. A job's record is made in
/// its callback: what the executor does around it is between the records.
class RclcppSystem : private SampleSink {
 public:
  /// `plan` is what hotpath gives the runner. Throws std::runtime_error, InputError.
  RclcppSystem(const Graph& graph, const GraphTasks& tasks, const nlohmann::json& plan, RunMemory& memory);
  /// After an error, too, no thread remains.
  ~RclcppSystem();
  RclcppSystem(const RclcppSystem&) = delete;
  RclcppSystem& operator=(const RclcppSystem&) = delete;

  void wait_until_matched(Time deadline) { nodes_->wait_until_matched(deadline); }
  /// Timers fall due at `epoch` plus their phases.
  void start(Time epoch, Time end);
  void stop();
  Time join();
  void close();
  [[nodiscard]] std::uint64_t arrived(TaskId task) const { return tasks_of_run_[task].next; }
  [[nodiscard]] std::vector<WorkerThread> workers() const;

 private:
  /// Runs the executor, in a thread of its own.
  void spin();
  void end_spinning();
  /// The threads of the executor exist, with their policies; or it has ended.
  [[nodiscard]] bool settled() const;
  struct OfTask {
    std::mutex mutex;
    std::uint64_t next = 0;  ///< Sequence after that of the last job.
    // Timers, whose jobs overlap in a reentrant group. What a job skips is known when the next one starts.
    std::optional<std::uint64_t> newest;                     ///< Sequence of the latest job that started.
    std::optional<JobRecord> last;                           ///< Its record, finished and not yet written.
    std::multimap<std::uint64_t, std::uint32_t> skipped_by;  ///< Others that run, by their sequences.
    rclcpp::TimerBase::SharedPtr timer;
    bool one_writer = true;
  };

  void deliver(TaskId task, const SampleInfo& info, Sample sample) override;
  void add_timer(TaskId task);
  void run_timer(TaskId task, std::optional<Time> expected);
  /// With the task's lock held, in the thread that runs the job.
  void timer_starts(OfTask& timer, std::uint64_t sequence, Worker worker);
  void timer_finished(OfTask& timer, JobRecord& record);
  /// Sequence of the timer's job that starts now.
  std::uint64_t timer_sequence(TaskId task, std::optional<Time> expected);
  void run(JobRecord& record, Sample sample);
  /// A log has one writer: `worker` is that of the calling thread, whoever ran the job.
  void write(const JobRecord& record, Worker worker);
  Worker own_worker(bool timer);

  const GraphTasks tasks_;
  RunMemory& memory_;
  Executor::Logs logs_;
  const ExecutorEntry& entry_;
  RclcppTransport* transport_ = nullptr;  // the nodes'
  std::unique_ptr<LiveNodes> nodes_;
  std::deque<OfTask> tasks_of_run_;
  std::shared_ptr<rclcpp::Executor> executor_;
  const PriorityExecutor* ours_ = nullptr;  ///< The executor, unless it is rclcpp's.
  ThreadPolicyRequest policy_;              ///< Of rclcpp's executors; obtained once `settled`.
  const std::size_t executor_threads_;
  Time epoch_{};
  std::atomic<Time> end_{kNever};
  std::atomic<Worker> threads_{0};
  std::thread thread_;
  std::atomic_bool prepared_{false};  ///< rclcpp's executors: `policy_` is obtained.
  std::atomic_bool ended_{false};
  std::exception_ptr error_;  ///< Once `ended_`.
};

}  // namespace hotpath
