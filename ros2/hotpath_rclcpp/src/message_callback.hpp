// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <rclcpp/rclcpp.hpp>

namespace hotpath {

/// Makes the middleware call back for each message of a subscription during this object's lifetime.
/// SubscriptionBase::set_on_new_message_callback() is unsafe: rclcpp frees that callback with the
/// subscription, but the middleware calls it until the rcl handle is gone, which the subscription's
/// event handlers share and an executor may hold for longer. This class therefore passes the
/// middleware a number instead of a pointer.
class MessageCallback {
 public:
  using Callback = std::function<void(std::size_t)>;

  /// May call `callback` before it returns. Throws rclcpp's exceptions for rcl errors.
  MessageCallback(const rclcpp::SubscriptionBase::SharedPtr& subscription, Callback callback);
  ~MessageCallback();
  MessageCallback(const MessageCallback&) = delete;
  MessageCallback& operator=(const MessageCallback&) = delete;

 private:
  const std::uintptr_t number_;
  const std::weak_ptr<rcl_subscription_t> handle_;
};

}  // namespace hotpath
