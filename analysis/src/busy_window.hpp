// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"
#include "interference.hpp"

namespace hotpath {

/// Task k of a fixed-priority set. Its jobs cannot be preempted after their last part has started.
struct LevelTask {
  std::int64_t wcet = 0, period = 0, jitter = 0;
  std::int64_t last_part = 0;      ///< Non-preemptive end of a job; for non-preemptive tasks the whole WCET.
  std::int64_t longest_lower = 0;  ///< Longest non-preemptive part of a lower-priority task; 0 for none.
};

/// Largest response time of task k over its level-k busy window. `higher` are the tasks of higher
/// priority; `utilisation` includes task k. std::nullopt if the level's busy window never ends: its
/// utilisation is above 1, or equal to 1 with blocking or jitter.
std::optional<std::int64_t> busy_window_response(const LevelTask& k, const Interference& higher,
                                                 const exact::Utilisation& utilisation, TimeModel model);

/// Blocking by a part of length `longest`; in discrete time it has started one unit earlier.
inline std::int64_t blocking(std::int64_t longest, TimeModel model) {
  return model == TimeModel::discrete && longest > 0 ? longest - 1 : longest;
}

/// Whether a job released exactly at w, when the blocked task would start, goes first. In
/// continuous time it does not after a blocking job, which ends an arbitrarily short time before w.
inline bool ties_interfere(std::int64_t blocked, TimeModel model) {
  return model == TimeModel::discrete || blocked == 0;
}

}  // namespace hotpath
