// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace hotpath {

/// What `hotpath replay` is told on the command line.
struct ReplayOptions {
  std::string run, executor, graph;  ///< Executor and graph: empty for the run's first, and its own.
  std::uint32_t repetition = 0, domain = 0;
  double speed = 1, start_s = 0;
  std::optional<double> duration_s;
  bool live = false, all_interfaces = false;
};

/// Publishes a repetition of a stored run, live or simulated, as `run --live` does, in scaled real time. What
/// happened before the start counts in the statistics and is not published; chain samples are numbered from
/// the first that is. Throws UsageError, InputError, TransportError.
void replay_run(const ReplayOptions& options);

}  // namespace hotpath
