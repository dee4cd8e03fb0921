// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hotpath_rclcpp_interfaces/msg/message4kb.hpp>

#include "hotpath/reference_system/task_history.hpp"

namespace hotpath {

/// The content of a message's words.
inline BoundedMessage& content(hotpath_rclcpp_interfaces::msg::Message4kb& message) {
  return *reinterpret_cast<BoundedMessage*>(message.words.data());
}
inline const BoundedMessage& content(const hotpath_rclcpp_interfaces::msg::Message4kb& message) {
  return *reinterpret_cast<const BoundedMessage*>(message.words.data());
}
static_assert(sizeof(BoundedMessage) <= sizeof(hotpath_rclcpp_interfaces::msg::Message4kb));
static_assert(alignof(BoundedMessage) <= alignof(std::uint64_t));

}  // namespace hotpath
