// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/ros2_reference.hpp"

#include <sstream>
#include <string>

namespace hotpath {

std::optional<std::filesystem::path> find_ros2_reference() {
  std::istringstream folders(HOTPATH_ROS2_REFERENCE_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code ignored;
    if (std::filesystem::is_directory(folder, ignored)) return folder;
  }
  return std::nullopt;
}

}  // namespace hotpath
