// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>
#include <diagnostic_msgs/DiagnosticStatus.h>

#include <string>

namespace hotpath {

/// Health of a node from two of its statistics, `seconds` apart: WARN at 1 skipped timestamp,
/// overwritten sample or deadline overrun per second or at 5 jobs in the queue; ERROR at 5 per
/// second or at 20 jobs.
diagnostic_msgs::DiagnosticStatus node_health(const std::string& name,
                                              const telemetry::NodeStatistics& before,
                                              const telemetry::NodeStatistics& now, double seconds);

/// Adds a line of details to a status.
void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, const std::string& value);

}  // namespace hotpath
