// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/Vector3Stamped.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>
#include <std_msgs/UInt8MultiArray.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include "outputs.hpp"

/// Converts the bridge's outputs to ROS 1 messages. C++17 only.
namespace hotpath {

std_msgs::Float64 to_message(const Scalar&);
std_msgs::String to_message(const Text&);
std_msgs::UInt8MultiArray to_message(const ByteArray&);
rosgraph_msgs::Clock to_message(const ClockTime&);
geometry_msgs::Vector3Stamped to_message(const StampedVector&);
visualization_msgs::MarkerArray to_message(const MarkerSet&);
diagnostic_msgs::DiagnosticArray to_message(const Diagnoses&);
sensor_msgs::PointCloud2 to_message(const PointCloud&);
tf2_msgs::TFMessage to_message(const StaticTransforms&);

}  // namespace hotpath
