// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"
#include "interference.hpp"

namespace hotpath {

/// Blocking by a job of length `longest`; in discrete time it has started one unit earlier.
inline std::int64_t blocking(std::int64_t longest, TimeModel model) {
  return model == TimeModel::discrete && longest > 0 ? longest - 1 : longest;
}

/// Whether a job released exactly at w, when the blocked task would start, goes first. In
/// continuous time it does not after a blocking job, which ends an arbitrarily short time before w.
inline bool ties_interfere(std::int64_t blocked, TimeModel model) {
  return model == TimeModel::discrete || blocked == 0;
}

}  // namespace hotpath
