// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace hotpath {

/// The folder of what the real ROS 2 stack measured on the same workloads (its README tells the files), in
/// the source tree or where it was installed. Nothing if it is in neither.
[[nodiscard]] std::optional<std::filesystem::path> find_ros2_reference();

}  // namespace hotpath
