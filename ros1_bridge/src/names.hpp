// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hotpath {

/// `text` as one part of a ROS name: its first 200 bytes, with every byte that is not an ASCII
/// letter or digit replaced by an underscore.
std::string ros_name(std::string_view text);

struct RosNames {
  std::vector<std::string> names;    ///< Parallel to the input, all different.
  std::vector<std::string> clashes;  ///< "`a-b` and `a_b`" for each name that got a number.
};

/// The ROS names of `texts`; duplicates get the suffix _2, _3 and so on.
RosNames ros_names(const std::vector<std::string>& texts);

}  // namespace hotpath
