// SPDX-License-Identifier: Apache-2.0
#include "ros_messages.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace hotpath {

namespace {

/// Clamps to the range of ROS 1: unsigned 32-bit seconds.
ros::Time to_time(std::int64_t ns) {
  constexpr std::int64_t kLast = std::int64_t{std::numeric_limits<std::uint32_t>::max()} * 1'000'000'000;
  ros::Time time;
  return time.fromNSec(static_cast<std::uint64_t>(std::clamp<std::int64_t>(ns, 0, kLast)));
}

template <class Vector>
Vector to_vector(const Point& p) {
  Vector vector;
  vector.x = p[0];
  vector.y = p[1];
  vector.z = p[2];
  return vector;
}

std_msgs::Header header(std::int64_t stamp_ns, const std::string& frame) {
  std_msgs::Header result;
  result.stamp = to_time(stamp_ns);
  result.frame_id = frame;
  return result;
}

int marker_type(Marker::Shape shape) {
  switch (shape) {
    case Marker::Shape::box:
      return visualization_msgs::Marker::CUBE;
    case Marker::Shape::arrow:
      return visualization_msgs::Marker::ARROW;
    case Marker::Shape::text:
      break;
  }
  return visualization_msgs::Marker::TEXT_VIEW_FACING;
}

}  // namespace

std_msgs::Float64 to_message(const Scalar& scalar) {
  std_msgs::Float64 message;
  message.data = scalar.value;
  return message;
}

std_msgs::String to_message(const Text& text) {
  std_msgs::String message;
  message.data = text.text;
  return message;
}

std_msgs::UInt8MultiArray to_message(const ByteArray& bytes) {
  std_msgs::UInt8MultiArray message;
  message.data = bytes.data;
  return message;
}

rosgraph_msgs::Clock to_message(const ClockTime& clock) {
  rosgraph_msgs::Clock message;
  message.clock = to_time(clock.time_ns);
  return message;
}

geometry_msgs::Vector3Stamped to_message(const StampedVector& vector) {
  geometry_msgs::Vector3Stamped message;
  message.header = header(vector.stamp_ns, vector.frame);
  message.vector = to_vector<geometry_msgs::Vector3>(vector.vector);
  return message;
}

visualization_msgs::MarkerArray to_message(const MarkerSet& set) {
  visualization_msgs::MarkerArray message;
  message.markers.reserve(set.markers.size() + 1);
  if (set.replaces_all) {
    message.markers.emplace_back();
    message.markers.back().header = header(set.stamp_ns, set.frame);
    message.markers.back().action = visualization_msgs::Marker::DELETEALL;
  }
  for (const Marker& marker : set.markers) {
    visualization_msgs::Marker& m = message.markers.emplace_back();
    m.header = header(set.stamp_ns, set.frame);
    m.ns = marker.group;
    m.id = marker.id;
    m.type = marker_type(marker.shape);
    m.action = visualization_msgs::Marker::ADD;
    m.pose.position = to_vector<geometry_msgs::Point>(marker.position);
    m.pose.orientation.w = 1;
    m.scale = to_vector<geometry_msgs::Vector3>(marker.scale);
    m.color.r = marker.color.red;
    m.color.g = marker.color.green;
    m.color.b = marker.color.blue;
    m.color.a = marker.color.alpha;
    m.text = marker.text;
    if (marker.shape == Marker::Shape::arrow) {
      m.points = {to_vector<geometry_msgs::Point>(marker.from), to_vector<geometry_msgs::Point>(marker.to)};
    }
  }
  return message;
}

diagnostic_msgs::DiagnosticArray to_message(const Diagnoses& diagnoses) {
  diagnostic_msgs::DiagnosticArray message;
  message.header = header(diagnoses.stamp_ns, "");
  for (const Diagnosis& diagnosis : diagnoses.all) {
    diagnostic_msgs::DiagnosticStatus& status = message.status.emplace_back();
    status.level = static_cast<std::int8_t>(diagnosis.level);
    status.name = diagnosis.name;
    status.message = diagnosis.message;
    status.hardware_id = diagnosis.hardware_id;
    for (const auto& [key, value] : diagnosis.values) {
      status.values.emplace_back();
      status.values.back().key = key;
      status.values.back().value = value;
    }
  }
  return message;
}

sensor_msgs::PointCloud2 to_message(const PointCloud& cloud) {
  constexpr const char* kNames[] = {"x", "y", "z", "intensity"};
  sensor_msgs::PointCloud2 message;
  message.header = header(cloud.stamp_ns, cloud.frame);
  for (const char* name : kNames) {
    sensor_msgs::PointField& field = message.fields.emplace_back();
    field.name = name;
    field.offset = static_cast<std::uint32_t>((message.fields.size() - 1) * sizeof(float));
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
  }
  message.height = 1;
  message.width = static_cast<std::uint32_t>(cloud.points.size());
  message.point_step = sizeof(cloud.points[0]);
  message.row_step = message.width * message.point_step;
  message.is_dense = 1;
  message.data.resize(message.row_step);
  if (!cloud.points.empty()) std::memcpy(message.data.data(), cloud.points.data(), message.data.size());
  return message;
}

tf2_msgs::TFMessage to_message(const StaticTransforms& transforms) {
  tf2_msgs::TFMessage message;
  for (const auto& translation : transforms.all) {
    geometry_msgs::TransformStamped& t = message.transforms.emplace_back();
    t.header = header(transforms.stamp_ns, translation.parent);
    t.child_frame_id = translation.child;
    t.transform.translation = to_vector<geometry_msgs::Vector3>(translation.offset);
    t.transform.rotation.w = 1;
  }
  return message;
}

}  // namespace hotpath
