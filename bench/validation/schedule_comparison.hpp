// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "results/schedule.hpp"

namespace hotpath {

struct TaskComparison {
  std::string task;
  double lost_percent[2] = {0, 0};  ///< Of the timestamps until the shorter run's last start.
};

/// Two runs of one task set side by side: [0] what was measured, [1] what was predicted.
struct ScheduleComparison {
  std::size_t jobs[2] = {0, 0};
  double similarity = 0;  ///< Of the order of the first 10000 jobs (job_order.hpp).
  /// The same for the order by_period().
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
ScheduleComparison compare_schedules(const Schedule& measured, const Schedule& predicted);

/// Shares of lost jobs that differ by no more than this many points are the same.
inline constexpr double kSameLoss_percent = 2;

/// The order of jobs and the losses agree as well as the simulator is to meet the golden traces.
bool agrees(const ScheduleComparison& comparison);

}  // namespace hotpath
