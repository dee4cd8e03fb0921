// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Section V-B of the paper: releasing one job takes up to delta ns; Delta_i prolongs the jobs of
/// tau_i. For release-and-execute, and in the tightened form for release-only: n * delta.

/// Release-only, Equation (3): the fixed point t_0 and the overhead of one task.
struct ReleaseOverhead {
  std::int64_t t0 = 0;        ///< Longest time a job executes, releases included.
  std::int64_t overhead = 0;  ///< Delta_i.
};

/// std::nullopt if it diverges: the releases alone use the whole processor (sum of delta / T_j >=
/// 1).
std::optional<ReleaseOverhead> release_overhead_ro(const PeriodicTasks& tasks, std::size_t position,
                                                   std::int64_t delta);

enum class ReleaseMode : std::uint8_t { release_only, release_and_execute };

using ResponseTimeAnalysis = std::function<ResponseTimes(const PeriodicTasks&)>;

/// Response time bounds of a task set with the release overhead in its execution times.
struct OverheadAwareResponse {
  PeriodicTasks tasks;  ///< C_i := C_i + Delta_i, the input of `bounds`.
  ResponseTimes bounds;
  bool tightened = false;  ///< Whether Delta_i = n * delta was used.
};

/// Applies `analysis` to C_i + Delta_i. For release_only, Delta_i first comes from Equation (3);
/// the bounds are tightened with n * delta only if that proves the set schedulable and its
/// deadlines are constrained. Throws AnalysisError if the overhead diverges, or if
/// release_and_execute would skip timestamps (C_i >= T_j for some j != i, condition C1 of Section
/// V-A).
OverheadAwareResponse with_release_overhead(const PeriodicTasks& tasks, std::int64_t delta, ReleaseMode mode,
                                            const ResponseTimeAnalysis& analysis);

}  // namespace hotpath
