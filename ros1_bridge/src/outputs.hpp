// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// The bridge's outputs as plain types. ROS 1 message headers do not compile as C++20, so the two
/// halves of the bridge share only this header. Instants are nanoseconds since the Unix epoch,
/// lengths are metres.
namespace hotpath {

using Point = std::array<double, 3>;

/// std_msgs/Float64
struct Scalar {
  double value = 0;
};

/// std_msgs/String
struct Text {
  std::string text;
};

/// std_msgs/UInt8MultiArray
struct ByteArray {
  std::vector<std::uint8_t> data;
};

/// rosgraph_msgs/Clock
struct ClockTime {
  std::int64_t time_ns = 0;
};

/// geometry_msgs/Vector3Stamped
struct StampedVector {
  std::int64_t stamp_ns = 0;
  std::string frame;
  Point vector{};
};

struct Color {
  float red = 0, green = 0, blue = 0, alpha = 1;
};

/// visualization_msgs/Marker
struct Marker {
  enum class Shape : std::uint8_t { box, arrow, text };
  Shape shape = Shape::box;
  std::string group;    ///< Marker namespace.
  std::int32_t id = 0;  ///< Unique within `group`.
  Point position{};     ///< Centre; unused by an arrow.
  Point scale{};  ///< Box: edges. Arrow: diameters of shaft and head, length of the head. Text: height in z.
  Point from{}, to{};  ///< Ends of an arrow.
  Color color;
  std::string text;
};

/// visualization_msgs/MarkerArray
struct MarkerSet {
  std::int64_t stamp_ns = 0;
  std::string frame;
  bool replaces_all = false;  ///< Deletes all earlier markers first.
  std::vector<Marker> markers;
};

/// diagnostic_msgs/DiagnosticStatus
struct Diagnosis {
  enum class Level : std::uint8_t { ok, warn, error, stale };
  Level level = Level::ok;
  std::string name, message, hardware_id;
  std::vector<std::array<std::string, 2>> values;
};

/// diagnostic_msgs/DiagnosticArray
struct Diagnoses {
  std::int64_t stamp_ns = 0;
  std::vector<Diagnosis> all;
};

/// sensor_msgs/PointCloud2 with the fields x, y, z, intensity
struct PointCloud {
  std::int64_t stamp_ns = 0;
  std::string frame;
  std::vector<std::array<float, 4>> points;
};

/// tf2_msgs/TFMessage
struct StaticTransforms {
  struct Translation {
    std::string parent, child;
    Point offset{};
  };
  std::int64_t stamp_ns = 0;
  std::vector<Translation> all;
};

}  // namespace hotpath
