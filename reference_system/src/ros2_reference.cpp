// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/ros2_reference.hpp"

namespace hotpath {

std::optional<std::filesystem::path> find_ros2_reference() {
  for (const char* folder : {HOTPATH_REFERENCE_SOURCE, HOTPATH_REFERENCE_INSTALLED}) {
    std::error_code ignored;
    if (std::filesystem::is_directory(folder, ignored)) return folder;
  }
  return std::nullopt;
}

}  // namespace hotpath
