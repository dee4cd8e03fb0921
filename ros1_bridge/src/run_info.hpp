// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>
#include <vector>

namespace hotpath {

/// A printable description of the first defect that prevents drawing or indexing a run, such as an
/// edge without a node or too many nodes; empty: none.
std::string run_defect(const telemetry::RunInfo& run);

/// Makes the displayed texts printable. Leaves run_id, topic_prefix and the edges' topics
/// unchanged, because they identify samples.
void make_printable(telemetry::RunInfo& run);

/// A description of the run as JSON, with the ROS names of nodes and chains (parallel to the
/// run's). Omits facts nested more than 64 deep.
std::string run_metadata(const telemetry::RunInfo& run, const std::vector<std::string>& node_names,
                         const std::vector<std::string>& chain_names);

}  // namespace hotpath
