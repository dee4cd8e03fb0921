// SPDX-License-Identifier: Apache-2.0
#include "message_callback.hpp"

#include <rcl/subscription.h>

#include <map>
#include <mutex>

#include "hotpath/live/pi_mutex.hpp"

namespace hotpath {

namespace {

class Registry {
 public:
  std::uintptr_t add(MessageCallback::Callback callback) {
    const std::lock_guard lock(mutex_);
    callbacks_[++last_] = std::make_shared<const MessageCallback::Callback>(std::move(callback));
    return last_;
  }
  void remove(std::uintptr_t number) {
    const std::lock_guard lock(mutex_);
    callbacks_.erase(number);
  }
  void call(std::uintptr_t number, std::size_t count) {
    std::shared_ptr<const MessageCallback::Callback> callback;
    {
      const std::lock_guard lock(mutex_);
      const auto found = callbacks_.find(number);
      if (found == callbacks_.end()) return;
      callback = found->second;
    }
    (*callback)(count);
  }

 private:
  PiMutex mutex_;
  std::uintptr_t last_ = 0;
  std::map<std::uintptr_t, std::shared_ptr<const MessageCallback::Callback>> callbacks_;
};

/// Never destroyed: the middleware's threads may outlive this library's static objects.
Registry& registry() {
  static Registry& instance = *new Registry;
  return instance;
}

void call(const void* number, std::size_t count) {
  registry().call(reinterpret_cast<std::uintptr_t>(number), count);
}

}  // namespace

MessageCallback::MessageCallback(const rclcpp::SubscriptionBase::SharedPtr& subscription, Callback callback)
    : number_(registry().add(std::move(callback))), handle_(subscription->get_subscription_handle()) {
  const rcl_ret_t ret = rcl_subscription_set_on_new_message_callback(
      subscription->get_subscription_handle().get(), call, reinterpret_cast<const void*>(number_));
  if (ret == RCL_RET_OK) return;
  registry().remove(number_);
  rclcpp::exceptions::throw_from_rcl_error(ret, "failed to set the callback for new messages");
}

MessageCallback::~MessageCallback() {
  const std::shared_ptr<rcl_subscription_t> handle = handle_.lock();
  if (handle && rcl_subscription_set_on_new_message_callback(handle.get(), nullptr, nullptr) != RCL_RET_OK) {
    rcl_reset_error();
  }
  registry().remove(number_);
}

}  // namespace hotpath
