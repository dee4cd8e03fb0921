// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <rclcpp/rclcpp.hpp>

namespace hotpath {

/// Has the middleware call back for each message of a subscription as long as this lives. Not by
/// SubscriptionBase::set_on_new_message_callback(): rclcpp frees that callback with the subscription, and the
/// middleware calls it until the rcl handle is gone, which each of the subscription's event handlers shares
/// and whoever serves it may hold for longer. So the middleware is given a number instead of a pointer.
class MessageCallback {
 public:
  using Callback = std::function<void(std::size_t)>;

  /// May call `callback` at once. Throws what rclcpp throws for an error of rcl.
  MessageCallback(const rclcpp::SubscriptionBase::SharedPtr& subscription, Callback callback);
  ~MessageCallback();
  MessageCallback(const MessageCallback&) = delete;
  MessageCallback& operator=(const MessageCallback&) = delete;

 private:
  const std::uintptr_t number_;
  const std::weak_ptr<rcl_subscription_t> handle_;
};

}  // namespace hotpath
