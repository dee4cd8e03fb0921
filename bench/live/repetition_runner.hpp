// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "results/run_record.hpp"
#include "results/summary.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::live {

/// Additional settings of a repetition on the real ROS 2 stack.
struct RclcppPlan {
  std::string runner;  ///< Path of the program.
  std::string graph_file;
  std::optional<double> load_percent;
};

/// All settings of one live repetition.
struct Plan : results::LiveSettings {
  const Graph* graph = nullptr;
  GraphTasks tasks;  ///< With the phases of this repetition.
  setup::ExecutorSpec executor;
  std::uint32_t repetition = 0;

  std::optional<ThreadPolicy> executor_policy, timer_policy;  ///< None: the executor's defaults.

  Duration length{};                             ///< From the epoch to the end, warm-up included.
  Duration time_out = std::chrono::seconds(20);  ///< Of answers, and of the set-up of small graphs.
  RclcppPlan rclcpp;                             ///< For Stack::rclcpp.
  /// Of the run whose repetitions a separate process publishes while they run; nullptr: none does.
  const results::RunRecord* published = nullptr;
};

struct Result {
  results::Repetition repetition;  ///< The records, also after a failure.
  std::vector<std::string>
      policies;  ///< Scheduling class obtained by each worker's thread: `timer_mgmt fifo:90`.
  bool timers_are_ordinary = false;  ///< A timer management thread got the ordinary policy.
  std::string failure;               ///< One sentence; empty: none.
  bool setup_failed = false;         ///< No repetition with this plan can succeed.
  bool interrupted = false;          ///< Ended early on request.
  bool measured = false;             ///< Nothing failed, and the records are complete up to their end.
  std::vector<std::string> warnings;
};

/// The executors (of parts()) that run in a process.
std::vector<std::size_t> parts_in(const Plan& plan, std::uint32_t process);

/// Process of each node: contiguous shares of the creation order, of nearly equal size.
std::vector<std::uint32_t> assign_processes(const Graph& graph, std::uint32_t processes);

/// Time limit for the processes until all endpoints are matched.
Duration set_up_limit(const Plan& plan);

/// Capacity of the records of one process.
RunMemory::Size memory_size(const Plan& plan, std::uint32_t process);

/// One process of a repetition, from its fork to its end: it sets the system up, runs it when the
/// coordinator says so, and reports. `memories`: of all processes of the repetition. Returns the
/// exit code.
int run_process(const Plan& plan, std::uint32_t process, const std::vector<std::uint32_t>& process_of_node,
                std::deque<RunMemory>& memories, const Channel& coordinator);

/// The process that publishes a repetition while it runs (`plan.published`), from its fork to its
/// end. It reads the records of the measured processes in `memories` and yields to all other
/// processes (nice 19). Messages with the coordinator: `matched` when it is ready, then `begin`,
/// then `stop` with the end of the run, then `done` with the number of lost chain samples. Returns
/// the exit code.
int run_publisher_process(const Plan& plan, const std::deque<RunMemory>& memories,
                          const Channel& coordinator);

/// Runs one repetition in fresh processes that share one epoch. The calling process must have one
/// thread only. `progress(elapsed)` is called about ten times a second.
Result run_repetition(const Plan& plan, const std::function<void(Duration)>& progress);

}  // namespace hotpath::live
