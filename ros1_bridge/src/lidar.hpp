// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>
#include <vector>

#include "event.hpp"
#include "outputs.hpp"

namespace hotpath {

/// A LiDAR driver of the graph: a sensor at the start of the hot path.
struct Lidar {
  std::uint32_t node = 0;  ///< Index into the run's nodes.
  std::string topic;
};

/// Once each, and not more than the first 1000: each costs a reader and a publisher.
std::vector<Lidar> lidars(const telemetry::RunInfo& run);

/// Stands in for a scan: the reference system's messages hold no points, so these are 256 on a circle, as
/// many bytes as the message, that turn with the message's sequence number. Intensity is the angle from the
/// scan's start, 0 to 1.
PointCloud stand_in_scan(const LidarSample& sample, const std::string& frame);

}  // namespace hotpath
