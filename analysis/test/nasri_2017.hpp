// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "hotpath/analysis/response_times.hpp"
#include "sag_job.hpp"

namespace hotpath {

/// Limits of an exploration; it stops when one is reached.
struct SagLimits {
  std::chrono::milliseconds time{60'000};
  std::size_t memory = std::size_t{1} << 30;  ///< Bytes of simultaneously stored states.
};

/// Reason for the end of an exploration.
enum class SagEnd : std::uint8_t { complete, time_limit, memory_limit };

/// Result of an exploration; times in the unit of the jobs.
struct SagResult {
  struct Finish {
    std::int64_t earliest = 0, latest = 0;
  };
  SagEnd end = SagEnd::complete;
  bool schedulable = false;    ///< The exploration is complete and no deadline was missed.
  std::vector<Finish> finish;  ///< By job, in the given order; final only if `end` is `complete`.
  std::uint64_t states = 0;    ///< Number after merging, including the initial state.
  std::uint64_t edges = 0;
};

/// Schedule-abstraction graph: explores every order in which a work-conserving non-preemptive
/// priority scheduler can run the jobs on one processor, for all releases and execution times in
/// their intervals (Nasri, Brandenburg: "An exact and sustainable analysis of non-preemptive
/// scheduling", RTSS 2017). Integer time. States with the same finished jobs and intersecting
/// availability are merged. The exploration continues after a missed deadline. Throws AnalysisError
/// for malformed jobs.
SagResult nasri_2017(const std::vector<SagJob>& jobs, const SagLimits& limits = {});

/// Largest latest finish minus earliest arrival of each task's jobs; `tasks` is the number of tasks of
/// sag_jobs().
ResponseTimes sag_response_times(const std::vector<SagJob>& jobs, const SagResult& result, std::size_t tasks);

}  // namespace hotpath
