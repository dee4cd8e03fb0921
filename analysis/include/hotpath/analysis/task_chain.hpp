// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// A cause-effect chain: positions in a PeriodicTasks, from source to sink. Tasks may repeat.
using TaskChain = std::vector<std::size_t>;

/// Whether positions represent fixed priorities. Under `dynamic` (EDF, FIFO) the position does not
/// determine the order of jobs.
enum class Priorities : std::uint8_t { fixed, dynamic };

/// Throws AnalysisError unless every element of the chain is a task of the set and has a response time bound.
void check_chain(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                 std::string_view method);

/// The handover delay x_i * R_i after element i of a chain: zero if tau_i has a higher priority
/// than tau_i+1 and no release jitter, because then a job of tau_i+1 released no earlier than a job
/// of tau_i cannot start before it (Duerr 2019, theorem 5.4).
inline std::int64_t handover_delay(const PeriodicTasks& tasks, const ResponseTimes& bounds,
                                   const TaskChain& chain, std::size_t i, Priorities priorities) {
  const bool after =
      priorities == Priorities::fixed && chain[i] < chain[i + 1] && tasks[chain[i]].jitter == 0;
  return after ? 0 : *bounds[chain[i]];
}

}  // namespace hotpath
