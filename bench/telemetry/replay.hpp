// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace hotpath::telemetry {

/// Command-line options of `hotpath replay`.
struct ReplayOptions {
  std::string run, executor, graph;  ///< Empty executor: the run's first. Empty graph: the run's own.
  std::uint32_t repetition = 0, domain = 0;
  double rate_percent = 100, start_s = 0;
  std::optional<double> duration_s;
  bool all_interfaces = false;
};

/// Publishes a repetition of a live or simulated run like `run --live`, in scaled real time. Jobs
/// before the start count in the statistics but are not published; chain samples are numbered from
/// the first published sample. Throws UsageError, InputError, TransportError.
void replay_run(const ReplayOptions& options);

}  // namespace hotpath::telemetry
