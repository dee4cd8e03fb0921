// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/registry.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/ros_names.hpp"
#include "hotpath_rclcpp/priority_executor.hpp"

namespace hotpath {

/// Validated PriorityExecutorOptions.
struct Setup {
  std::string name;  ///< As given, with its variants.
  const ExecutorEntry* executor = nullptr;
  SchedulerOptions scheduler;
  std::vector<GivenPriority> priorities;
  std::string priorities_file;
  Graph graph;
  GraphTasks tasks;               ///< The graph's tasks; none is local.
  std::vector<Duration> offsets;  ///< By task of the graph; empty: none are given.
  bool learn = true;
  ThreadPolicyRequest executor_threads, timer_thread;
  std::optional<ThreadPolicy> middleware_threads;
};

/// Throws std::invalid_argument for invalid options, InputError for invalid files.
[[nodiscard]] Setup understand(const PriorityExecutorOptions& options);

}  // namespace hotpath
