// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

/// A handle, which is never dereferenced.
inline const void* handle(std::uintptr_t address) { return std::bit_cast<const void*>(address); }

// The tracepoints that the traced program of the tests calls, as tracetools 8 declares them.
extern "C" {
void ros_trace_rcl_node_init(const void* node, const void* rmw, const char* name, const char* space);
void ros_trace_rcl_publisher_init(const void* publisher, const void* node, const void* rmw, const char* topic,
                                  std::size_t depth);
void ros_trace_callback_start(const void* callback, bool intra_process);
void ros_trace_callback_end(const void* callback);
void ros_trace_rcl_subscription_init(const void* subscription, const void* node, const void* rmw,
                                     const char* topic, std::size_t depth);
void ros_trace_rclcpp_subscription_init(const void* subscription, const void* rclcpp);
void ros_trace_rclcpp_subscription_callback_added(const void* rclcpp, const void* callback);
void ros_trace_rcl_timer_init(const void* timer, std::int64_t period);
void ros_trace_rclcpp_timer_callback_added(const void* timer, const void* callback);
void ros_trace_rclcpp_timer_link_node(const void* timer, const void* node);
void ros_trace_rcl_publish(const void* publisher, const void* message);
void ros_trace_rmw_publish(const void* publisher, const void* message, std::int64_t timestamp);
void ros_trace_rmw_take(const void* subscription, const void* message, std::int64_t timestamp, bool taken);
bool ros_trace_enabled_rmw_take();
void ros_trace_do_rmw_take(const void* subscription, const void* message, std::int64_t timestamp, bool taken);
/// Calls of the stand-in so far; the real library does not have it.
[[gnu::weak]] std::uint64_t stand_in_calls();
}
