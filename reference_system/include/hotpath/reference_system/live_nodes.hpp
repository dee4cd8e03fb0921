// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/live/executor.hpp"
#include "hotpath/reference_system/sensor_calls.hpp"

namespace hotpath {

/// The nodes of a graph in this process (`tasks.set[id].local`), connected to a transport; runs
/// their jobs.
class LiveNodes : public JobHandler {
 public:
  virtual ~LiveNodes() = default;
  /// Creates the endpoints; samples go to `sink`. Throws TransportError.
  virtual void connect(SampleSink& sink) = 0;
  /// See Transport.
  virtual void wait_until_matched(Time deadline) = 0;
  [[nodiscard]] virtual std::uint64_t refused() const = 0;
  /// States the jobs to the sensor, which outlives the nodes. Before the first job.
  virtual void report_to(const SensorCalls& sensor) = 0;
};

}  // namespace hotpath
