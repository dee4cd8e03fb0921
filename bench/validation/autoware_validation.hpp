// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "validation/latency_quantiles.hpp"

namespace hotpath {

/// Hot-path latency of Autoware under one executor, with the real stack's phases.
struct AutowareValidation {
  std::string executor;  ///< As the reference names it.
  LatencyQuantiles measured, simulated;
  std::string verdict;
};

/// All of REFERENCE/rclcpp_autoware_phases.csv. Throws UsageError, InputError.
std::vector<AutowareValidation> validate_autoware(const std::filesystem::path& reference);

}  // namespace hotpath
