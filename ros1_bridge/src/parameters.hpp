// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "node_health.hpp"
#include "ros_node.hpp"
#include "telemetry_input.hpp"

namespace hotpath {

/// Private ROS parameters of the bridge; README.md describes them.
struct Parameters {
  TelemetryOptions telemetry;
  std::vector<std::string> chains;  ///< Names; empty: all.
  std::uint32_t ros_queue = 1000;
  std::uint32_t bytes_ros_queue = 512;
  std::uint32_t graph_every = 1;
  std::uint32_t points_every = 1;
  std::uint32_t diagnostics_every = 10;
  bool points = true;
  bool clock = true;
  std::string frame;
  HealthLimits limits;
};

/// Reads and checks the parameters; logs unknown ones. Throws ParameterError.
Parameters read_parameters(const RosNode& node);

}  // namespace hotpath
