// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "explain/causes.hpp"
#include "explain/data_path.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/workload.hpp"
#include "program/text.hpp"
#include "results/run_record.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::explain {

/// Its task and sequence; empty: no job.
[[nodiscard]] inline std::string name_of(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? "" : program::concat(set[job.task].name, " ", job.sequence);
}

/// An executor, as far as its decisions need to be named.
struct ServingExecutor {
  const ExecutorTraits& traits;
  Duration service_wait;                    ///< SchedulerOptions::service_wait.
  std::uint32_t first_worker, threads;      ///< The workers that run its jobs, one after the other.
  std::optional<PriorityOrder> order = {};  ///< Priority events queues.
  /// Simulated: the longest time from one job to the next that dispatch, wait, wake-up and releases
  /// can take. std::nullopt: not known.
  std::optional<Duration> most_overhead = {};
  Duration second_wake_up{};  ///< Of a timer's job: the timer thread wakes the thread that runs it.

  [[nodiscard]] bool many_threads() const { return threads > 1; }
};

/// What an explanation needs to know of a graph under one executor or deployment.
class System {
 public:
  /// `cores` of the machine. `tasks` must outlive the object. Throws as simulated::System does.
  System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks, results::RunKind kind,
         unsigned cores);

  [[nodiscard]] const Task& task(TaskId id) const { return tasks.set[id]; }
  [[nodiscard]] const ServingExecutor& executor_of(TaskId id) const {
    return executors_[setup::executor_of(spec_, id)];
  }
  /// Number of cores on which a worker may run; simulated.
  [[nodiscard]] unsigned cores_of(std::size_t worker) const {
    return static_cast<unsigned>(
        std::popcount((worker < threads_.size() ? threads_[worker].processors : cores_) & cores_));
  }
  /// Whether a job on `other` that started at `other_start` keeps `worker`, busy since `since`, from
  /// the core that they share. With equal priorities, the job that started later has the core.
  [[nodiscard]] bool outranks(std::size_t other, Time other_start, std::size_t worker, Time since) const {
    if (std::max(other, worker) >= threads_.size()) return other_start > since;
    const SimulatedThread &a = threads_[other], &b = threads_[worker];
    if ((a.processors & b.processors & cores_) == 0) return false;
    return a.priority != b.priority ? a.priority > b.priority : other_start > since;
  }
  /// Whether the tasks' jobs never overlap, because they share a callback group.
  [[nodiscard]] bool share_group(TaskId a, TaskId b) const {
    return task(a).group == task(b).group &&
           tasks.set.groups[task(a).group] == CallbackGroup::mutually_exclusive &&
           &executor_of(a) == &executor_of(b) &&
           executor_of(a).traits.timers != TimerHandling::release_and_execute;
  }

  const GraphTasks& tasks;
  const results::RunKind kind;
  const bool simulated;
  const Duration delivery;     ///< From publication to arrival; simulated.
  const bool wall_clock_work;  ///< Jobs work until an instant of the clock.
  const std::vector<ChainIndex> chains;

 private:
  const std::uint64_t cores_;  // of the machine, as bits
  std::vector<ServingExecutor> executors_;
  const setup::ExecutorSpec spec_;
  std::vector<SimulatedThread> threads_;  // by worker; simulated
};

/// Divides the latency of an output from `begin` on among causes: of the hot path, to the start of the last
/// job of the path; else to its finish, with the first job's wait. Of a response time, the path is the job.
/// Part::step is an index into `path`. `times`: of every job that works, in a simulation; nullptr: not known.
[[nodiscard]] std::vector<Part> parts_of_path(const System& system, const JobWindow& window,
                                              const ExecutionTimes* times, const Jobs& path, Time begin,
                                              Latency latency);

/// Explains outputs of one repetition while it reads the repetition's jobs.
class Explainer {
 public:
  using Use = std::function<void(const Explanation&)>;

  /// `chain`: index into System::chains; none: response times of the outputs' tasks. `times` as for
  /// parts_of_path(). `system` and `times` must outlive the object.
  Explainer(const System& system, std::optional<std::uint32_t> chain, Latency latency,
            std::vector<Output> outputs, const ExecutionTimes* times, Use use);

  /// Adds a job; started jobs in order of start.
  void add(const JobRecord& record);
  void end() {
    now_ = kNever;
    explain_finished();
  }

  [[nodiscard]] Time last_start() const { return now_; }

 private:
  void explain_finished();
  void explain_output(const Seen& job, const Output& output);

  const System& system_;
  const Latency latency_;
  const ExecutionTimes* const times_;
  std::vector<Output> outputs_;  // by task and sequence
  const Use use_;
  JobWindow window_;
  std::optional<DataPath> paths_;  // none: response times
  Duration longest_{};             // of the outputs
  /// Jobs of outputs, explained when all jobs that overlap are known.
  std::vector<std::pair<const Seen*, const Output*>> unfinished_;
  std::size_t added_ = 0;
  Time now_ = Time::min();
};

}  // namespace hotpath::explain
