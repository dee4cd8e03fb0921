// SPDX-License-Identifier: Apache-2.0
// Counts the calls of tracepoints in place of tracetools.
#include "tracetools.hpp"

#include <atomic>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<std::uint64_t> calls;

}  // namespace

void ros_trace_rcl_node_init(const void*, const void*, const char* name, const char*) {
  if (std::strcmp(name, "node") == 0) ++calls;
}
void ros_trace_rcl_publisher_init(const void*, const void*, const void*, const char*, std::size_t depth) {
  if (depth == 7) ++calls;
}
void ros_trace_callback_start(const void*, bool intra_process) {
  if (intra_process) ++calls;
}
void ros_trace_callback_end(const void*) { ++calls; }
void ros_trace_rcl_subscription_init(const void*, const void*, const void*, const char*, std::size_t) {
  ++calls;
}
void ros_trace_rclcpp_subscription_init(const void*, const void*) { ++calls; }
void ros_trace_rclcpp_subscription_callback_added(const void*, const void*) { ++calls; }
void ros_trace_rcl_timer_init(const void*, std::int64_t) { ++calls; }
void ros_trace_rclcpp_timer_callback_added(const void*, const void*) { ++calls; }
void ros_trace_rclcpp_timer_link_node(const void*, const void*) { ++calls; }
void ros_trace_rcl_publish(const void*, const void*) { ++calls; }
void ros_trace_rmw_publish(const void*, const void*, std::int64_t) { ++calls; }
void ros_trace_rmw_take(const void*, const void*, std::int64_t, bool) { ++calls; }
bool ros_trace_enabled_rmw_take() { return std::getenv("STAND_IN_ENABLED") != nullptr; }
void ros_trace_do_rmw_take(const void*, const void*, std::int64_t timestamp, bool taken) {
  if (timestamp == -5 && taken) ++calls;
}
std::uint64_t stand_in_calls() { return calls; }
