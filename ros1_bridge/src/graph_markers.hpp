// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <array>
#include <string>

#include "outputs.hpp"

namespace hotpath {

/// Draws the graph in the plane z = 0, seen from above: nodes are boxes coloured by utilization,
/// with a red rim on the hot path; edges are arrows; texts show median and 99th percentile.
/// `statistics` is nullptr before the first statistics. Repeated calls for one graph use the same
/// marker ids.
MarkerSet graph_markers(const telemetry::RunInfo& run, const telemetry::Statistics* statistics,
                        const std::string& frame);

/// Colour of a node with this utilization, as a share of one core.
Color utilization_color(double utilization);

/// Breaks a long name into two lines, at a change of case or an underscore near the middle. The
/// second line may be empty.
std::array<std::string, 2> two_lines(const std::string& name);

/// The centre of a node's box.
Point node_position(const telemetry::NodeInfo& node);

/// The position of a driver's scan: beside the node, in free space.
Point scan_position(const telemetry::NodeInfo& lidar_driver);

}  // namespace hotpath
