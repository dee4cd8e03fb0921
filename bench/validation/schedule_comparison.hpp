// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "results/schedule.hpp"
#include "results/statistics.hpp"

namespace hotpath {

/// A golden trace (results/ros2_reference/traces): the tasks with their periods, execution times and first
/// releases, and every job of the real ROS 2 stack. Throws UsageError.
///
/// It holds no timestamps: they follow from the next calls. A job that the timer's own call started (wait
/// sets, release-and-execute) has the timer's next call at the previous job; one that a releaser started has
/// the timestamp of its number.
Schedule read_golden_trace(const std::filesystem::path& file, bool release_only);

struct TaskComparison {
  std::string task;
  double lost_percent[2] = {0, 0};  ///< Of the timestamps until the shorter run's last start.
};

/// Two runs of one task set side by side: [0] what was measured, [1] what was predicted.
struct ScheduleComparison {
  std::size_t jobs[2] = {0, 0};
  /// Twice the length of the longest common subsequence of the tasks' names by start, over the sum of both
  /// lengths: 1 for the same order, the best value that difflib's ratio could reach. Of the first 10000 jobs.
  double similarity = 0;
  /// The same with every task replaced by the first of its period: blind to the order among equal periods.
  double similarity_by_period = 0;
  struct Difference {
    std::size_t place = 0;
    Time at{};
    std::string task[2];
  };
  std::optional<Difference> first_difference;
  std::vector<TaskComparison> tasks;
  Quantiles lateness_ms[2];          ///< Start minus timestamp.
  Quantiles response_ms[2];          ///< Finish minus timestamp.
  Quantiles response_authors_ms[2];  ///< Timers.

  double largest_loss_difference() const;
};
ScheduleComparison compare(const Schedule& measured, const Schedule& predicted);

}  // namespace hotpath
