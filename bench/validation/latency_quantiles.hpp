// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/csv.hpp"

namespace hotpath {

/// Hot-path latencies in milliseconds, by simulation, run or real stack.
struct LatencyQuantiles {
  std::optional<std::size_t> n;  ///< None: the source does not say.
  double p10 = kNoValue, p50 = kNoValue, p90 = kNoValue, p99 = kNoValue, max = kNoValue;
};

LatencyQuantiles latency_quantiles(std::vector<double> samples_ms);

/// Of a row of rclcpp_autoware_phases.csv.
LatencyQuantiles real_latencies(const CsvReader& row);

/// Whether two medians agree within a share `tolerance`; if not, `otherwise` says why.
std::string median_verdict(const LatencyQuantiles& measured, const LatencyQuantiles& simulated,
                           double tolerance, const std::string& otherwise);

}  // namespace hotpath
