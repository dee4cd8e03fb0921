// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// From the least to the largest of several values.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double x);
  /// Whether they have a value in common, or nearly so.
  bool meets(const Range& other, double slack) const;
};

/// What several runs of one set under one executor did.
struct TimersOnlyRanges {
  Range imu_lost_percent;
  /// The authors' response times, mean over tasks.
  Range response_authors_p50_ms, response_authors_p99_ms;
};

/// Lost jobs and the authors' response times of the real stack's longer runs. The phases of those runs are
/// unknown: predictions are ranges over creation steps.
struct TimersOnlyValidation {
  std::string set, executor;
  TimersOnlyRanges measured, simulated;
  std::string verdict;
};

/// All of REFERENCE/rclcpp_timers_only.csv. Throws UsageError, InputError.
std::vector<TimersOnlyValidation> validate_timers_only(const std::filesystem::path& reference);

}  // namespace hotpath
