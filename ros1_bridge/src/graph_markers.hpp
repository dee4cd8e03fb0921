// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <array>
#include <string>

#include "outputs.hpp"

namespace hotpath {

/// The graph in the plane z = 0, seen from above: a box for each node, whose colour is its utilization and
/// whose rim is red on the hot path, arrows for edges, texts with median and 99th percentile. `statistics`
/// may be nullptr before there are any. Markers of the same graph have the same identities each time.
MarkerSet graph_markers(const telemetry::RunInfo& run, const telemetry::Statistics* statistics,
                        const std::string& frame);

/// Colour of a node that uses this share of one core.
Color utilization_color(double utilization);

/// Breaks a long name in two, at a change of case or at an underscore near its middle; the second may be
/// empty.
std::array<std::string, 2> two_lines(const std::string& name);

/// Where a node's box has its centre.
Point node_position(const telemetry::NodeInfo& node);

/// Beside the node, where nothing else is drawn.
Point scan_position(const telemetry::NodeInfo& lidar_driver);

}  // namespace hotpath
