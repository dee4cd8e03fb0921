// SPDX-License-Identifier: Apache-2.0
#include "hotpath/tracing/event.hpp"

namespace hotpath::tracing {

// A table. NOLINTNEXTLINE(readability-function-size)
std::span<const EventFormat> formats() {
  using enum EventKind;
  constexpr auto a = FieldType::address, i = FieldType::integer, t = FieldType::text, g = FieldType::gid;
  static const std::vector<EventFormat> formats = {
      {rcl_init, "ros2:rcl_init", {{"context_handle", a}, {"version", t}}},
      {node_init,
       "ros2:rcl_node_init",
       {{"node_handle", a}, {"rmw_handle", a}, {"node_name", t}, {"namespace", t}}},
      {publisher_init,
       "ros2:rcl_publisher_init",
       {{"publisher_handle", a},
        {"node_handle", a},
        {"rmw_publisher_handle", a},
        {"topic_name", t},
        {"queue_depth", a}}},
      {subscription_init,
       "ros2:rcl_subscription_init",
       {{"subscription_handle", a},
        {"node_handle", a},
        {"rmw_subscription_handle", a},
        {"topic_name", t},
        {"queue_depth", a}}},
      {rmw_publisher_init, "ros2:rmw_publisher_init", {{"rmw_publisher_handle", a}, {"gid", g}}},
      {rmw_subscription_init, "ros2:rmw_subscription_init", {{"rmw_subscription_handle", a}, {"gid", g}}},
      {service_init,
       "ros2:rcl_service_init",
       {{"service_handle", a}, {"node_handle", a}, {"service_name", t}}},
      {client_init, "ros2:rcl_client_init", {{"client_handle", a}, {"node_handle", a}}},
      {rclcpp_subscription_init,
       "ros2:rclcpp_subscription_init",
       {{"subscription_handle", a}, {"subscription", a}}},
      {subscription_callback_added,
       "ros2:rclcpp_subscription_callback_added",
       {{"subscription", a}, {"callback", a}}},
      {callback_register, "ros2:rclcpp_callback_register", {{"callback", a}, {"symbol", t}}, false},
      {timer_init, "ros2:rcl_timer_init", {{"timer_handle", a}, {"period", i}}},
      {timer_callback_added, "ros2:rclcpp_timer_callback_added", {{"timer_handle", a}, {"callback", a}}},
      {timer_link_node, "ros2:rclcpp_timer_link_node", {{"timer_handle", a}, {"node_handle", a}}},
      {service_callback_added,
       "ros2:rclcpp_service_callback_added",
       {{"service_handle", a}, {"callback", a}}},
      {callback_start, "ros2:callback_start", {{"callback", a}, {"is_intra_process", i}}},
      {callback_end, "ros2:callback_end", {{"callback", a}}},
      {rclcpp_publish, "ros2:rclcpp_publish", {{"message", a}}, false},
      {rcl_publish, "ros2:rcl_publish", {{"publisher_handle", a}, {"message", a}}},
      {rmw_publish, "ros2:rmw_publish", {{"rmw_publisher_handle", a}, {"message", a}, {"timestamp", i}}},
      {intra_publish, "ros2:rclcpp_intra_publish", {{"publisher_handle", a}, {"message", a}}},
      {rmw_take,
       "ros2:rmw_take",
       {{"rmw_subscription_handle", a}, {"message", a}, {"source_timestamp", i}, {"taken", i}}},
      {rcl_take, "ros2:rcl_take", {{"message", a}}, false},
      {rclcpp_take, "ros2:rclcpp_take", {{"message", a}}, false},
      {dispatch_subscription_callback,
       "ros2:dispatch_subscription_callback",
       {{"callback", a}, {"source_stamp", i}}},
      {bind_stamp, "ros2_caret:dds_bind_addr_to_stamp", {{"addr", a}, {"source_stamp", i}}},
      {buffer_to_ipb, "ros2:rclcpp_buffer_to_ipb", {{"buffer", a}, {"ipb", a}}},
      {ipb_to_subscription, "ros2:rclcpp_ipb_to_subscription", {{"ipb", a}, {"subscription", a}}},
      {ring_buffer_enqueue, "ros2:rclcpp_ring_buffer_enqueue", {{"buffer", a}, {"index", a}}},
      {ring_buffer_dequeue, "ros2:rclcpp_ring_buffer_dequeue", {{"buffer", a}, {"index", a}}},
      {get_next_ready, "ros2:rclcpp_executor_get_next_ready", {}, false},
      {wait_for_work, "ros2:rclcpp_executor_wait_for_work", {{"timeout", i}}},
      {execute, "ros2:rclcpp_executor_execute", {{"handle", a}}, false},
  };
  return formats;
}

}  // namespace hotpath::tracing
