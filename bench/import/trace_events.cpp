// SPDX-License-Identifier: Apache-2.0
#include "import/trace_events.hpp"

namespace hotpath {

std::span<const TraceEventFormat> trace_event_formats() {
  using K = TraceEventKind;
  static constexpr std::array kFormats = {
      TraceEventFormat{"ros2:rcl_init", K::rcl_init, {"context_handle"}, {"version"}},
      TraceEventFormat{"ros2:rcl_node_init", K::node_init, {"node_handle"}, {"node_name", "namespace"}},
      TraceEventFormat{"ros2:rcl_publisher_init",
                       K::publisher_init,
                       {"publisher_handle", "node_handle", "rmw_publisher_handle"},
                       {"topic_name"}},
      TraceEventFormat{"ros2:rcl_subscription_init",
                       K::subscription_init,
                       {"subscription_handle", "node_handle", "rmw_subscription_handle", "queue_depth"},
                       {"topic_name"}},
      TraceEventFormat{"ros2:rclcpp_subscription_init",
                       K::rclcpp_subscription_init,
                       {"subscription_handle", "subscription"}},
      TraceEventFormat{"ros2:rclcpp_subscription_callback_added",
                       K::subscription_callback_added,
                       {"subscription", "callback"}},
      TraceEventFormat{"ros2:rcl_timer_init", K::timer_init, {"timer_handle", "period"}},
      TraceEventFormat{
          "ros2:rclcpp_timer_callback_added", K::timer_callback_added, {"timer_handle", "callback"}},
      TraceEventFormat{"ros2:rclcpp_timer_link_node", K::timer_link_node, {"timer_handle", "node_handle"}},
      TraceEventFormat{
          "ros2:rclcpp_service_callback_added", K::service_callback_added, {"service_handle", "callback"}},
      TraceEventFormat{"ros2:callback_start", K::callback_start, {"callback", "is_intra_process"}},
      TraceEventFormat{"ros2:callback_end", K::callback_end, {"callback"}},
      TraceEventFormat{"ros2:rcl_publish", K::rcl_publish, {"publisher_handle", "message"}},
      TraceEventFormat{"ros2:rmw_publish", K::rmw_publish, {"message", "timestamp"}},
      TraceEventFormat{"ros2:rclcpp_intra_publish", K::intra_publish, {"publisher_handle", "message"}},
      TraceEventFormat{
          "ros2:rmw_take", K::rmw_take, {"rmw_subscription_handle", "source_timestamp", "taken"}},
      TraceEventFormat{"ros2:dispatch_subscription_callback",
                       K::dispatch_subscription_callback,
                       {"callback", "source_stamp"}},
      TraceEventFormat{"ros2_caret:dds_bind_addr_to_stamp", K::bind_stamp, {"addr", "source_stamp"}},
      TraceEventFormat{"ros2:rclcpp_buffer_to_ipb", K::buffer_to_ipb, {"buffer", "ipb"}},
      TraceEventFormat{"ros2:rclcpp_ipb_to_subscription", K::ipb_to_subscription, {"ipb", "subscription"}},
      TraceEventFormat{"ros2:rclcpp_ring_buffer_enqueue", K::ring_buffer_enqueue, {"buffer", "index"}},
      TraceEventFormat{"ros2:rclcpp_ring_buffer_dequeue", K::ring_buffer_dequeue, {"buffer", "index"}},
      TraceEventFormat{"ros2:rclcpp_executor_wait_for_work", K::wait_for_work, {"timeout"}},
  };
  return kFormats;
}

}  // namespace hotpath
