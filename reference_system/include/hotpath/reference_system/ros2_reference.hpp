// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace hotpath {

/// The folder with the measurements of the real ROS 2 stack on the same workloads (its README
/// describes the files), in the source tree or the installation. std::nullopt if it is in neither.
[[nodiscard]] std::optional<std::filesystem::path> find_ros2_reference();

}  // namespace hotpath
