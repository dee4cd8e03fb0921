// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "results/run_record.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::explain {

/// An executor, as far as its decisions need to be named.
struct ServingExecutor {
  ExecutorTraits traits;
  std::optional<PriorityOrder> order;           ///< Priority events queues.
  Duration service_wait{};                      ///< SchedulerOptions::service_wait.
  std::uint32_t first_worker = 0, threads = 1;  ///< The workers that run its jobs, one after the other.
  /// Simulated: the longest time from one job to the next that dispatch, wait, wake-up and releases
  /// can take. std::nullopt: not known.
  std::optional<Duration> most_overhead;
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
  [[nodiscard]] bool is_timer(TaskId id) const { return task(id).kind == TaskKind::timer; }
  [[nodiscard]] const ServingExecutor& executor_of(TaskId id) const { return executors_[executor_of_[id]]; }
  /// Number of cores on which a worker may run; simulated.
  [[nodiscard]] unsigned cores_of(std::size_t worker) const;
  /// Whether a job on `other` that started at `other_start` keeps `worker`, busy since `since`, from
  /// the core that they share. With equal priorities, the job that started later has the core.
  [[nodiscard]] bool outranks(std::size_t other, Time other_start, std::size_t worker, Time since) const;
  /// Whether the tasks' jobs never overlap, because they share a callback group.
  [[nodiscard]] bool share_group(TaskId a, TaskId b) const;

  const GraphTasks& tasks;
  const results::RunKind kind;
  const bool simulated;
  const Duration delivery;     ///< From publication to arrival; simulated.
  const bool wall_clock_work;  ///< Jobs work until an instant of the clock.
  const std::vector<ChainIndex> chains;

 private:
  const std::uint64_t cores_;  // of the machine, as bits
  std::vector<ServingExecutor> executors_;
  std::vector<std::uint32_t> executor_of_;  // by task
  std::vector<SimulatedThread> threads_;    // by worker; simulated
};

}  // namespace hotpath::explain
