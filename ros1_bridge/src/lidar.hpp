// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>
#include <sensor_msgs/PointCloud2.h>

#include <string>
#include <vector>

#include "event.hpp"

namespace hotpath {

/// A LiDAR driver of the graph: a sensor at the start of the hot path.
struct Lidar {
  std::uint32_t node = 0;  ///< Index into the run's nodes.
  std::string topic;
};

/// The LiDAR drivers of a run, without duplicates. At most the first 1000, as each needs a reader
/// and a publisher.
std::vector<Lidar> lidars(const telemetry::RunInfo& run);

/// A substitute for a scan, since the reference system's messages hold no points: 256 points on a
/// circle, of the message's size in bytes. The circle turns with the sequence number. Intensity is
/// the angle from the scan's start, 0 to 1.
sensor_msgs::PointCloud2 stand_in_scan(const LidarSample& sample, const std::string& frame);

}  // namespace hotpath
