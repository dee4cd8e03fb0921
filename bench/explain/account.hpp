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

/// Divides a latency, which ends at the start of the last job of the path, among causes. Part::step is an
/// index into `path`.
[[nodiscard]] std::vector<Part> parts_of_path(const Surroundings& around,
                                              const std::vector<const Seen*>& path, Duration latency);

}  // namespace hotpath::explain
