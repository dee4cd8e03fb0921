// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <string>

#include "outputs.hpp"

namespace hotpath {

/// Thresholds of a node's health: at or above `warn` it is WARN, at or above `error` it is ERROR.
struct Limit {
  double warn = 0;
  double error = 0;
};

struct HealthLimits {
  Limit skipped{1, 5};      ///< Timestamps skipped per second.
  Limit overwritten{1, 5};  ///< Samples overwritten per second.
  Limit overruns{1, 5};     ///< Jobs per second that finished after their deadline.
  Limit queue{5, 20};       ///< Jobs that are currently released but not started.
};

/// Health of a node from two of its statistics, `seconds` apart.
Diagnosis node_health(const std::string& name, const telemetry::NodeStatistics& before,
                      const telemetry::NodeStatistics& now, double seconds, const HealthLimits& limits);

}  // namespace hotpath
