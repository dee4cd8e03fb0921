// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ros/time.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>

namespace hotpath {

/// From nanoseconds since the Unix epoch. Clamps to the range of ROS 1: unsigned 32-bit seconds.
inline ros::Time to_time(std::int64_t ns) {
  constexpr std::int64_t kLast = std::int64_t{std::numeric_limits<std::uint32_t>::max()} * 1'000'000'000;
  return ros::Time().fromNSec(static_cast<std::uint64_t>(std::clamp<std::int64_t>(ns, 0, kLast)));
}

/// This instant.
inline std::int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

inline std_msgs::Header header(std::int64_t stamp_ns, const std::string& frame) {
  std_msgs::Header result;
  result.stamp = to_time(stamp_ns);
  result.frame_id = frame;
  return result;
}

/// A geometry_msgs/Point or Vector3, in metres.
template <class Vector>
Vector at(double x, double y, double z) {
  Vector vector;
  vector.x = x;
  vector.y = y;
  vector.z = z;
  return vector;
}

}  // namespace hotpath
