// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// One job of a schedule-abstraction graph, with the columns of the SAG tools' job files.
struct SagJob {
  std::uint64_t task = 0;
  std::uint64_t job = 0;
  std::int64_t arrival_min = 0, arrival_max = 0;
  std::int64_t cost_min = 0, cost_max = 0;
  std::int64_t deadline = 0;  ///< Absolute.
  std::int64_t priority = 0;  ///< Smaller first; ties by task, then job.
};

enum class SagPolicy : std::uint8_t { fixed_priority, edf };

/// Limit of jobs per exploration.
inline constexpr std::int64_t kMaxSagJobs = 5'000'000;

/// All jobs with a nominal release in one hyperperiod (synchronous tasks). With phases: before the
/// largest phase plus two hyperperiods. With jitter: for as many further hyperperiods as the
/// longest busy window may reach back. Sorted by release. Task numbers are positions, execution
/// times [bcet, wcet], release windows [r, r + jitter]. Throws AnalysisError if the utilisation is
/// above 1, or equal to 1 with jitter, if the hyperperiod overflows, or if there are more than
/// kMaxSagJobs jobs.
std::vector<SagJob> sag_jobs(const PeriodicTasks& tasks, SagPolicy policy);

/// Writes the format of the SAG tools (np-schedulability-analysis), so that they can read a failing
/// set.
void write_sag_csv(std::ostream& out, const std::vector<SagJob>& jobs);

}  // namespace hotpath
