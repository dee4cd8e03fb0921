// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/deployment.hpp"

namespace hotpath {

struct Deployed;

/// On what a graph runs live.
enum class Stack : std::uint8_t {
  native,  ///< hotpath's own executors and transports.
  rclcpp,  ///< The real ROS 2 stack: the program hotpath_rclcpp_runner of a ROS 2 workspace.
};
constexpr auto enum_texts(Stack) {
  return std::to_array<EnumText<Stack>>({{Stack::native, "native"}, {Stack::rclcpp, "rclcpp"}});
}
inline constexpr std::string_view kOnRclcpp = "@rclcpp";

/// What runs a graph: an executor, or a deployment of several. An executor as a user names it: `NAME`, or
/// `NAME:VARIANT[:VARIANT]`, then kOnRclcpp if it is that of the real stack, with the variants `inherit`,
/// `first` (rule for subscriptions), `lifo`, `fifo` (ties), or a number of threads where there can be
/// several.
struct ExecutorSpec {
  std::string label;                     ///< As given; the column `executor`.
  const ExecutorEntry* entry = nullptr;  ///< nullptr: a deployment.
  SchedulerOptions scheduler;
  std::shared_ptr<const Deployed> deployment;
  Stack stack = Stack::native;
};

/// A deployment whose executors are known.
struct Deployed {
  Deployment plan;
  std::vector<ExecutorSpec> executors;  ///< Parallel to plan.executors.
};

/// Every executor of `spec`, which may be one.
[[nodiscard]] std::span<const ExecutorSpec> parts(const ExecutorSpec& spec);

/// The deployment of that name or file. Throws InputError with the line of an executor that there is not.
[[nodiscard]] ExecutorSpec deploy(const std::string& name_or_path, const Graph& graph,
                                  const GraphTasks& tasks, const SchedulerOptions& defaults);

/// The same of a deployment made by this program.
[[nodiscard]] ExecutorSpec deploy(Deployment plan, const SchedulerOptions& defaults);

/// Throws UsageError that lists what there is.
ExecutorSpec parse_executor(const std::string& text, const SchedulerOptions& defaults);

/// The paper's executors (Section VII), and all of the registry.
std::vector<std::string> paper_executor_names();
std::vector<std::string> all_executor_names();

}  // namespace hotpath
