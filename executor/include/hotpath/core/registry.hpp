// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/scheduler.hpp"

namespace hotpath {

struct SchedulerOptions {
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  unsigned workers = 0;  ///< Multi-threaded: number of workers; 0 takes rclcpp's default, max(2, processors).
};

/// One executor that a user can name.
struct ExecutorEntry {
  std::string_view name;         ///< As on the command line and in the column `executor`.
  std::string_view class_name;   ///< rclcpp's name of the executor class.
  std::string_view description;  ///< One line.
  bool paper;  ///< The paper's modified events executor, whose timer management thread is raised.
  std::unique_ptr<Scheduler> (*make)(const TaskSet&, const SchedulerOptions&);
};

/// All executors, in the order in which they are listed. A new one is one row here.
std::span<const ExecutorEntry> executors();

/// nullptr for an unknown name.
const ExecutorEntry* find_executor(std::string_view name);

}  // namespace hotpath
