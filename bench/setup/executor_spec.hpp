// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/deployment.hpp"

namespace hotpath::setup {

/// The software stack of a live run.
enum class Stack : std::uint8_t {
  native,  ///< hotpath's own executors and transports.
  rclcpp,  ///< ROS 2, through the program hotpath_rclcpp_runner of a ROS 2 workspace.
};
constexpr auto enum_texts(Stack) { return texts_in_order<Stack>({"native", "rclcpp"}); }

/// An executor, or a deployment of several executors. A user names an executor by its
/// ExecutorLabel. Variants: `inherit`, `first` (rule for subscriptions), `lifo`, `fifo` (ties), or
/// the number of threads of a multi-threaded executor.
struct ExecutorSpec {
  std::string label;                     ///< As given; the column `executor`.
  const ExecutorEntry* entry = nullptr;  ///< nullptr: a deployment.
  SchedulerOptions scheduler;
  Stack stack = Stack::native;
  Deployment plan = {};                      ///< A single executor has all tasks: only a description.
  std::vector<ExecutorSpec> executors = {};  ///< Those of `plan`.
  /// In a deployment: its name, threads and process, and the number of its first worker in a run.
  DeployedExecutor place = {};
  std::uint32_t first_worker = 0;
};

/// All executors of `spec`: one, or the executors of the deployment.
[[nodiscard]] inline std::span<const ExecutorSpec> parts(const ExecutorSpec& spec) {
  return spec.entry ? std::span(&spec, 1) : std::span(spec.executors);
}

/// The index in parts() of the executor that has the task.
[[nodiscard]] inline std::uint32_t executor_of(const ExecutorSpec& spec, TaskId task) {
  return spec.entry ? 0 : spec.plan.executor_of[task];
}

/// The threads of an executor that is no deployment, without its timer thread.
[[nodiscard]] unsigned job_threads(const ExecutorSpec& executor);

/// Throws InputError with the line of an unknown executor.
[[nodiscard]] ExecutorSpec deploy(Deployment plan, const SchedulerOptions& defaults);

/// Throws UsageError that lists the known executors.
ExecutorSpec parse_executor(const std::string& text, const SchedulerOptions& defaults);

/// `NAME[:RULE][:TIES]`: without defaults, and without the number of threads.
[[nodiscard]] std::string name_with_rules(const ExecutorEntry& entry, const SchedulerOptions& scheduler);

/// The paper's executors (Section VII), and the whole registry.
std::vector<std::string> paper_executor_names();
std::vector<std::string> all_executor_names();

}  // namespace hotpath::setup
