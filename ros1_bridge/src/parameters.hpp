// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <xmlrpcpp/XmlRpcValue.h>

#include <string>

#include "telemetry_input.hpp"

namespace hotpath {

/// Private ROS parameters of the bridge; README.md describes them.
struct Parameters {
  TelemetryOptions telemetry;
  bool points = true;
  bool clock = true;
  std::string frame;
};

/// Reads and checks `given`, the private parameters of a node as a dictionary. `unknown`: set to a
/// message about the parameters that do not exist; empty: none. Throws std::invalid_argument.
Parameters read_parameters(XmlRpc::XmlRpcValue given, const std::string& node, std::string& unknown);

}  // namespace hotpath
