// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "validation/schedule_comparison.hpp"

namespace hotpath {

/// A run's schedule against the real stack's of the same task set under the same executor.
struct RunAgainstGolden {
  std::string set;
  double phases_differ_ms = 0;  ///< At most, of the timers' first releases.
  double real_busy_percent = 0, run_busy_percent = 0;
  ScheduleComparison comparison;  ///< Real stack, run.
  std::string verdict;
};

/// Against the golden trace of the graph's task set under the same executor, if there is one. Throws
/// InputError.
std::optional<RunAgainstGolden> against_golden(const std::filesystem::path& reference,
                                               const std::string& graph, const Schedule& run,
                                               const ExecutorEntry& executor);

/// Between the phases of `set` and the first timestamps of other timers of the same names.
double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first);

}  // namespace hotpath
