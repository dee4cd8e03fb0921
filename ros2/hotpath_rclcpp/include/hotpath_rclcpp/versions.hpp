// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <rclcpp/version.h>
#include <rclcpp/rclcpp.hpp>

#include <memory>
#include <string>
#include <type_traits>

/// Hides the differences between rclcpp versions, from Humble to Rolling.
namespace hotpath::versions {

/// How Executor::add_node() and similar functions take a pointer: by value, since Lyrical by
/// reference.
template <class Pointer, class = void>
struct Passed {
  using Type = const Pointer&;
};
template <class Pointer>
struct Passed<Pointer, std::void_t<decltype(static_cast<void (rclcpp::Executor::*)(Pointer, bool)>(
                           &rclcpp::Executor::remove_node))>> {
  using Type = Pointer;
};
using NodeBase = rclcpp::node_interfaces::NodeBaseInterface;
using NodeBaseArgument = Passed<NodeBase::SharedPtr>::Type;
using NodeArgument = Passed<std::shared_ptr<rclcpp::Node>>::Type;
using GroupArgument =
    std::conditional_t<std::is_reference_v<NodeBaseArgument>, const rclcpp::CallbackGroup::SharedPtr&,
                       rclcpp::CallbackGroup::SharedPtr>;

/// Since Iron, a timer reports its reset through a callback.
#define HOTPATH_TIMERS_TELL_OF_RESETS RCLCPP_VERSION_GTE(21, 0, 0)

inline constexpr bool kTimersTellOfResets = HOTPATH_TIMERS_TELL_OF_RESETS;

/// Sets the reset callback where rclcpp has one; an empty `callback` clears it.
inline void on_reset(rclcpp::TimerBase& timer, const std::function<void(std::size_t)>& callback) {
#if HOTPATH_TIMERS_TELL_OF_RESETS
  callback ? timer.set_on_reset_callback(callback) : timer.clear_on_reset_callback();
#else
  static_cast<void>(timer);
  static_cast<void>(callback);
#endif
}

/// Calls the timer and runs its callback. Returns false if it is cancelled and nothing ran.
template <class Timer>
bool run_timer(Timer& timer) {
  if constexpr (std::is_same_v<decltype(timer.call()), bool>) {  // up to Iron
    if (!timer.call()) return false;
    timer.execute_callback();
  } else {
    const std::shared_ptr<void> data = timer.call();
    if (!data) return false;
    timer.execute_callback(data);
  }
  return true;
}

inline void run(rclcpp::Waitable& waitable, int entity) {
  std::shared_ptr<void> data = waitable.take_data_by_entity_id(static_cast<std::size_t>(entity));
#if RCLCPP_VERSION_GTE(28, 0, 0)
  waitable.execute(std::as_const(data));
#else
  waitable.execute(data);
#endif
}

/// False for a QoS event of Humble's rmw_fastrtps (6.2): if an event is pending while its callback
/// is set, the middleware calls back with a wrong pointer and the program crashes.
inline bool may_call_back(const rclcpp::Waitable& waitable) {
#if RCLCPP_VERSION_GTE(21, 0, 0)
  static_cast<void>(waitable);
  return true;
#else
  const bool fast_dds =
      std::string(rmw_get_implementation_identifier()).find("fastrtps") != std::string::npos;
  return !fast_dds || dynamic_cast<const rclcpp::QOSEventHandlerBase*>(&waitable) == nullptr;
#endif
}

/// Whether an intra-process subscription has a message. It ignores the wait set.
inline bool has_message(rclcpp::experimental::SubscriptionIntraProcessBase& subscription) {
#if RCLCPP_VERSION_GTE(28, 0, 0)
  return subscription.is_ready(rcl_get_zero_initialized_wait_set());
#else
  return subscription.is_ready(nullptr);
#endif
}

/// The guard condition that is triggered when the node or the group gets another entity.
inline rclcpp::GuardCondition& changes_of(NodeBase& node) {
#if RCLCPP_VERSION_GTE(21, 0, 0)
  return *node.get_shared_notify_guard_condition();
#else
  return node.get_notify_guard_condition();
#endif
}
inline rclcpp::GuardCondition::SharedPtr changes_of(rclcpp::CallbackGroup& group,
                                                    const rclcpp::Context::SharedPtr& context) {
#if RCLCPP_VERSION_GTE(21, 0, 0)
  static_cast<void>(context);
  return group.get_notify_guard_condition();
#else
  return group.get_notify_guard_condition(context);
#endif
}

inline rclcpp::GuardCondition& reference(rclcpp::GuardCondition& condition) { return condition; }
inline rclcpp::GuardCondition& reference(const rclcpp::GuardCondition::SharedPtr& condition) {
  return *condition;
}

/// The clock of a timer: rclcpp has no accessor for it.
inline rclcpp::Clock::SharedPtr clock_of(const rclcpp::TimerBase& timer) {
  struct Access : rclcpp::TimerBase {
    static rclcpp::Clock::SharedPtr rclcpp::TimerBase::*member() { return &Access::clock_; }
  };
  return timer.*Access::member();
}

}  // namespace hotpath::versions
