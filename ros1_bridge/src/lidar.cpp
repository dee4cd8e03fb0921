// SPDX-License-Identifier: Apache-2.0
#include "lidar.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <set>

#include "messages.hpp"

namespace hotpath {

std::vector<Lidar> lidars(const telemetry::RunInfo& run) {
  constexpr std::size_t kMost = 1000;
  std::vector<Lidar> result;
  std::set<std::string> known;
  for (const telemetry::EdgeInfo& edge : run.edges()) {
    const bool source = edge.hot() && run.nodes()[edge.source()].type() == "sensor";
    if (!source || !known.insert(edge.topic()).second) continue;
    result.push_back({edge.source(), edge.topic()});
    if (result.size() == kMost) break;
  }
  return result;
}

sensor_msgs::PointCloud2 stand_in_scan(const LidarSample& sample, const std::string& frame) {
  using XyzIntensity = std::array<float, 4>;
  constexpr std::size_t kPoints = 4096 / sizeof(XyzIntensity);
  constexpr std::uint64_t kTurn = 100;  // scans per full turn
  std::array<XyzIntensity, kPoints> points;
  const double start = static_cast<double>(sample.sequence % kTurn) / static_cast<double>(kTurn);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double share = static_cast<double>(i) / kPoints;
    const double angle = 2 * M_PI * (start + share);
    points[i] = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0,
                 static_cast<float>(share)};
  }
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header(sample.stamp_ns, frame);
  for (const char* name : {"x", "y", "z", "intensity"}) {
    sensor_msgs::PointField& field = cloud.fields.emplace_back();
    field.name = name;
    field.offset = static_cast<std::uint32_t>((cloud.fields.size() - 1) * sizeof(float));
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
  }
  cloud.height = 1;
  cloud.width = kPoints;
  cloud.point_step = sizeof(XyzIntensity);
  cloud.row_step = sizeof points;
  cloud.is_dense = 1;
  cloud.data.resize(sizeof points);
  std::memcpy(cloud.data.data(), points.data(), sizeof points);
  return cloud;
}

}  // namespace hotpath
