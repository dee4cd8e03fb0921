// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"
#include "interference.hpp"

namespace hotpath {

/// Task k of a fixed-priority set whose jobs cannot be preempted once their last part has started.
struct LevelTask {
  std::int64_t wcet = 0, period = 0, jitter = 0;
  std::int64_t last_part = 0;      ///< Non-preemptive end of a job; the whole wcet for non-preemptive tasks.
  std::int64_t longest_lower = 0;  ///< Longest non-preemptive part of a lower-priority task; 0 for none.
};

/// Largest response time of task k over its level-k busy window. `higher` are the tasks of higher priority,
/// `utilisation` those and task k. None when the level's busy window
/// never ends: its utilisation is above 1, or equal to 1 with blocking or jitter.
std::optional<std::int64_t> busy_window_response(const LevelTask& k, const Interference& higher,
                                                 const exact::Utilisation& utilisation, TimeModel model);

/// Blocking by a part of length `longest`: in discrete time it has started one unit before.
inline std::int64_t blocking(std::int64_t longest, TimeModel model) {
  return model == TimeModel::discrete && longest > 0 ? longest - 1 : longest;
}

/// Whether a job released at the very instant w at which the blocked task would start goes first. Not so in
/// continuous time behind a blocking job: its true end is an arbitrarily short time before w.
inline bool ties_interfere(std::int64_t blocked, TimeModel model) {
  return model == TimeModel::discrete || blocked == 0;
}

}  // namespace hotpath
