// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>
#include <geometry_msgs/Point.h>
#include <std_msgs/ColorRGBA.h>
#include <visualization_msgs/MarkerArray.h>

#include <array>
#include <string>

namespace hotpath {

/// Draws the graph in the plane z = 0, seen from above: nodes are boxes coloured by utilization,
/// with a red rim on the hot path; edges are arrows; texts show median and 99th percentile.
/// `statistics` is nullptr before the first statistics: then all earlier markers are deleted.
/// Repeated calls for one graph use the same marker ids.
visualization_msgs::MarkerArray graph_markers(const telemetry::RunInfo& run,
                                              const telemetry::Statistics* statistics,
                                              const std::string& frame);

/// Colour of a node with this utilization, as a share of one core.
std_msgs::ColorRGBA utilization_color(double utilization);

/// Breaks a long name into two lines, at a change of case or an underscore near the middle. The
/// second line may be empty.
std::array<std::string, 2> two_lines(const std::string& name);

/// The position of a driver's scan: beside the node, in free space.
geometry_msgs::Point scan_position(const telemetry::NodeInfo& lidar_driver);

}  // namespace hotpath
