// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// The tracepoints of tracetools 4 (Humble), with their parameters: HUMBLE(name, parameters, arguments).
#define HUMBLE_TRACEPOINTS(HUMBLE)                                                                         \
  HUMBLE(rcl_init, (const void*), (handle(1)))                                                             \
  HUMBLE(rcl_node_init, (const void*, const void*, const char*, const char*),                              \
         (handle(1), handle(2), "node", "/"))                                                              \
  HUMBLE(rmw_publisher_init, (const void*, const std::uint8_t*), (handle(4), nullptr))                     \
  HUMBLE(rcl_publisher_init, (const void*, const void*, const void*, const char*, std::size_t),            \
         (handle(3), handle(1), handle(4), "/a", 1))                                                       \
  HUMBLE(rclcpp_publish, (const void*, const void*), (handle(3), handle(9)))                               \
  HUMBLE(rcl_publish, (const void*, const void*), (handle(3), handle(9)))                                  \
  HUMBLE(rmw_publish, (const void*), (handle(9)))                                                          \
  HUMBLE(rmw_subscription_init, (const void*, const std::uint8_t*), (handle(6), nullptr))                  \
  HUMBLE(rcl_subscription_init, (const void*, const void*, const void*, const char*, std::size_t),         \
         (handle(5), handle(1), handle(6), "/a", 1))                                                       \
  HUMBLE(rclcpp_subscription_init, (const void*, const void*), (handle(5), handle(7)))                     \
  HUMBLE(rclcpp_subscription_callback_added, (const void*, const void*), (handle(7), handle(8)))           \
  HUMBLE(rmw_take, (const void*, const void*, std::int64_t, bool), (handle(6), handle(9), 5, true))        \
  HUMBLE(rcl_take, (const void*), (handle(9)))                                                             \
  HUMBLE(rclcpp_take, (const void*), (handle(9)))                                                          \
  HUMBLE(rcl_service_init, (const void*, const void*, const void*, const char*),                           \
         (handle(1), handle(1), handle(1), "/s"))                                                          \
  HUMBLE(rclcpp_service_callback_added, (const void*, const void*), (handle(1), handle(2)))                \
  HUMBLE(rcl_client_init, (const void*, const void*, const void*, const char*),                            \
         (handle(1), handle(1), handle(1), "/s"))                                                          \
  HUMBLE(rcl_timer_init, (const void*, std::int64_t), (handle(1), 10))                                     \
  HUMBLE(rclcpp_timer_callback_added, (const void*, const void*), (handle(1), handle(2)))                  \
  HUMBLE(rclcpp_timer_link_node, (const void*, const void*), (handle(1), handle(2)))                       \
  HUMBLE(rclcpp_callback_register, (const void*, const char*), (handle(2), "f()"))                         \
  HUMBLE(callback_start, (const void*, bool), (handle(2), true))                                           \
  HUMBLE(callback_end, (const void*), (handle(2)))                                                         \
  HUMBLE(rcl_lifecycle_state_machine_init, (const void*, const void*), (handle(1), handle(2)))             \
  HUMBLE(rcl_lifecycle_transition, (const void*, const char*, const char*), (handle(1), "inactive", "on")) \
  HUMBLE(rclcpp_executor_get_next_ready, (), ())                                                           \
  HUMBLE(rclcpp_executor_wait_for_work, (std::int64_t), (-1))                                              \
  HUMBLE(rclcpp_executor_execute, (const void*), (handle(2)))

#define HUMBLE_DECLARATION(name, parameters, arguments) void ros_trace_##name parameters;
extern "C" {
HUMBLE_TRACEPOINTS(HUMBLE_DECLARATION)
std::uint64_t stand_in_calls();
}
