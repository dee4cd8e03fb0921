// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "explain/causes.hpp"
#include "explain/data_path.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath::explain {

/// The jobs around a latency, and what is known of them.
struct Surroundings {
  const System& system;
  const JobWindow& window;
  const ExecutionTimes* times;  ///< Of every job that works, in a simulation; nullptr: not known.
};

/// Divides the response time of a job among causes.
[[nodiscard]] std::vector<Part> parts_of_response(const Surroundings& around, const Seen& job);

/// Divides a latency from `begin` on among causes: of the hot path, to the start of the last job of the path;
/// else to its finish, with the first job's wait. Part::step is an index into `path`.
[[nodiscard]] std::vector<Part> parts_of_path(const Surroundings& around,
                                              const std::vector<const Seen*>& path, Time begin,
                                              bool hot_path);

}  // namespace hotpath::explain
