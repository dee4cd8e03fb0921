// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>

namespace hotpath {

/// A description of the run as JSON, with the ROS names of nodes and chains (parallel to the
/// run's). Omits facts nested more than 64 deep.
std::string run_metadata(const telemetry::RunInfo& run, const std::vector<std::string>& node_names,
                         const std::vector<std::string>& chain_names);

}  // namespace hotpath
