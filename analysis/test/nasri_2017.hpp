// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// One job of a schedule-abstraction graph, in integer time.
struct SagJob {
  std::size_t task = 0;
  std::int64_t arrival_min = 0, arrival_max = 0;
  std::int64_t cost_min = 0, cost_max = 0;
  std::int64_t priority = 0;  ///< Smaller first; ties by task, then in the given order.
  friend bool operator==(const SagJob&, const SagJob&) = default;
};

struct SagFinish {
  std::int64_t earliest = 0, latest = 0;
  friend bool operator==(const SagFinish&, const SagFinish&) = default;
};

/// Schedule-abstraction graph: explores every order in which a work-conserving non-preemptive
/// priority scheduler can run the jobs on one processor, for all releases and execution times in
/// their intervals (Nasri, Brandenburg: "An exact and sustainable analysis of non-preemptive
/// scheduling", RTSS 2017). States with the same finished jobs and intersecting availability are
/// merged. `jobs` are sorted by `arrival_min`. The finish of each job, in their order.
std::vector<SagFinish> nasri_2017(const std::vector<SagJob>& jobs);

/// The largest response times of the tasks' jobs under `policy`, fp or edf, from their phases on. All
/// jobs with a nominal release in one hyperperiod are explored (synchronous tasks); with phases,
/// before the largest phase plus two hyperperiods; with jitter, for as many further hyperperiods as
/// the longest busy window may reach back. The utilisation is at most 1, and less with jitter.
ResponseTimes sag_response_times(const PeriodicTasks& tasks, Policy policy);

}  // namespace hotpath
