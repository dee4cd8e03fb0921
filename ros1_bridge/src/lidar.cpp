// SPDX-License-Identifier: Apache-2.0
#include "lidar.hpp"

#include <cmath>
#include <numbers>
#include <set>
#include <string_view>

namespace hotpath {

std::vector<Lidar> lidars(const telemetry::RunInfo& run) {
  constexpr std::size_t kMost = 1000;
  std::vector<Lidar> result;
  std::set<std::string_view> known;
  for (const telemetry::EdgeInfo& edge : run.edges()) {
    const bool source = edge.hot() && run.nodes()[edge.source()].type() == "sensor";
    if (!source || !known.insert(edge.topic()).second) continue;
    result.push_back({edge.source(), edge.topic()});
    if (result.size() == kMost) break;
  }
  return result;
}

PointCloud stand_in_scan(const LidarSample& sample, const std::string& frame) {
  constexpr std::size_t kPoints = 4096 / sizeof(PointCloud::points[0]);
  constexpr std::uint64_t kTurn = 100;  // scans per full turn
  constexpr double kRadius = 1.0;
  PointCloud cloud;
  cloud.stamp_ns = sample.stamp_ns;
  cloud.frame = frame;
  cloud.points.reserve(kPoints);
  const double start = static_cast<double>(sample.sequence % kTurn) / static_cast<double>(kTurn);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double share = static_cast<double>(i) / kPoints;
    const double angle = 2 * std::numbers::pi * (start + share);
    cloud.points.push_back({static_cast<float>(kRadius * std::cos(angle)),
                            static_cast<float>(kRadius * std::sin(angle)), 0, static_cast<float>(share)});
  }
  return cloud;
}

}  // namespace hotpath
