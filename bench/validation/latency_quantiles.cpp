// SPDX-License-Identifier: Apache-2.0
#include "validation/latency_quantiles.hpp"

#include <algorithm>
#include <cmath>

#include "program/text.hpp"

namespace hotpath {

LatencyQuantiles latency_quantiles(std::vector<double> samples_ms) {
  std::sort(samples_ms.begin(), samples_ms.end());
  const Quantiles q = quantiles(samples_ms);
  return {q.n, quantile(samples_ms, 0.1), q.p50, q.p90, q.p99, q.max};
}

LatencyQuantiles real_latencies(const CsvReader& row) {
  return {std::nullopt,
          row.number<double>("hot_path_p10_ms"),
          row.number<double>("hot_path_p50_ms"),
          row.number<double>("hot_path_p90_ms"),
          row.number<double>("hot_path_p99_ms"),
          row.number<double>("hot_path_max_ms")};
}

std::string median_verdict(const LatencyQuantiles& measured, const LatencyQuantiles& simulated,
                           double tolerance, const std::string& otherwise) {
  const double percent = 100 * (simulated.p50 / measured.p50 - 1);
  if (std::abs(percent) <= 100 * tolerance) return text("the median agrees (%+.1f %%)", percent);
  return text("the median is %+.1f %% off: ", percent) + otherwise;
}

}  // namespace hotpath
