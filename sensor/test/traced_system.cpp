// SPDX-License-Identifier: Apache-2.0
// traced_system JOBS TAKEN [PERIOD_MS [BUSY_MS]]: the tracepoints of a node /source, whose timer
// publishes /a, and a node /space/sink, which takes every TAKEN-th message. The timer's jobs run one
// period apart, by default without any wait, and each works for BUSY_MS. Prints `done`.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "tracetools.hpp"

namespace {

using std::chrono::steady_clock;

const void* const source = handle(0x100);
const void* const publisher = handle(0x110);
const void* const rmw_publisher = handle(0x120);
const void* const timer = handle(0x130);
const void* const timer_callback = handle(0x140);
const void* const sink = handle(0x200);
const void* const subscription = handle(0x210);
const void* const rmw_subscription = handle(0x220);
const void* const rclcpp_subscription = handle(0x230);
const void* const sink_callback = handle(0x240);
const void* const message = handle(0x300);

void create_nodes(std::int64_t period_ns) {
  ros_trace_rcl_node_init(source, handle(1), "source", "/");
  ros_trace_rcl_publisher_init(publisher, source, rmw_publisher, "/a", 1);
  ros_trace_rcl_timer_init(timer, period_ns);
  ros_trace_rclcpp_timer_callback_added(timer, timer_callback);
  ros_trace_rclcpp_timer_link_node(timer, source);
  ros_trace_rcl_node_init(sink, handle(2), "sink", "/space");
  ros_trace_rcl_subscription_init(subscription, sink, rmw_subscription, "/a", 1);
  ros_trace_rclcpp_subscription_init(subscription, rclcpp_subscription);
  ros_trace_rclcpp_subscription_callback_added(rclcpp_subscription, sink_callback);
}

void work(std::chrono::milliseconds busy) {
  const auto end = steady_clock::now() + busy;
  while (steady_clock::now() < end) continue;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::chrono::milliseconds period(argc > 3 ? std::atoi(argv[3]) : 0),
      busy(argc > 4 ? std::atoi(argv[4]) : 0);
  auto next = steady_clock::now() + period;
  create_nodes(period.count() > 0 ? std::chrono::nanoseconds(period).count() : 1'000'000);
  for (std::int64_t i = 1; i <= std::atol(argv[1]); ++i) {
    std::this_thread::sleep_until(next);
    next += period;
    ros_trace_callback_start(timer_callback, false);
    work(busy);
    ros_trace_rcl_publish(publisher, message);
    ros_trace_rmw_publish(rmw_publisher, message, i);
    ros_trace_callback_end(timer_callback);
    if (i % std::atol(argv[2]) != 0) continue;
    ros_trace_rmw_take(rmw_subscription, message, i, true);
    ros_trace_callback_start(sink_callback, false);
    ros_trace_callback_end(sink_callback);
  }
  std::cout << "done" << std::endl;
  return 0;
}
