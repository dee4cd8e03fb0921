// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hotpath {

/// `text` as one part of a ROS name: its first 200 bytes, where what is no ASCII letter, digit or underscore
/// becomes an underscore.
std::string ros_name(std::string_view text);

struct RosNames {
  std::vector<std::string> names;    ///< Parallel to the input, all different.
  std::vector<std::string> clashes;  ///< `a-b and a_b`, for those that had to get a number.
};

/// The ROS names of `texts`; where two are the same, the later ends in _2, _3 ...
RosNames ros_names(const std::vector<std::string>& texts);

}  // namespace hotpath
