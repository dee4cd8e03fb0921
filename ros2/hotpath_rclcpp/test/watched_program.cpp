// SPDX-License-Identifier: Apache-2.0
// A system for watch_test.py: `watched_program EXECUTOR SAMPLES [intra_process]`. A timer of 10 ms
// publishes SAMPLES samples, which a filter passes on to a sink; one executor runs all three. Says
// `done` when the last sample has arrived, and then waits for SIGINT.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace {

using std_msgs::msg::Int32;
using namespace std::chrono_literals;

int run(const std::string& executor_name, int samples, bool intra_process) {
  const auto executor = hotpath::test::make_executor(executor_name);
  if (!executor) return EXIT_FAILURE;
  const auto options = rclcpp::NodeOptions().use_intra_process_comms(intra_process);
  const auto source = std::make_shared<rclcpp::Node>("source", options);
  const auto filter = std::make_shared<rclcpp::Node>("filter", "perception", options);
  const auto sink = std::make_shared<rclcpp::Node>("sink", "perception", options);
  const rclcpp::QoS qos(static_cast<std::size_t>(samples));
  const auto points = source->create_publisher<Int32>("points", qos);
  const auto objects = filter->create_publisher<Int32>("objects", qos);
  const auto filtered = filter->create_subscription<Int32>(
      "/points", qos, [&](Int32::ConstSharedPtr sample) { objects->publish(*sample); });
  int got = 0;
  const auto received = sink->create_subscription<Int32>("objects", qos, [&](Int32::ConstSharedPtr) {
    if (++got == samples) std::puts("done"), std::fflush(stdout);
  });
  if (!hotpath::test::eventually(
          [&] { return points->get_subscription_count() == 1 && objects->get_subscription_count() == 1; })) {
    return EXIT_FAILURE;
  }
  int sent = 0;
  rclcpp::TimerBase::SharedPtr timer;
  timer = source->create_wall_timer(10ms, [&] {
    if (sent == samples) return;  // EventsExecutor runs expiries that it queued before the cancellation
    Int32 sample;
    sample.data = ++sent;
    points->publish(sample);
    if (sent == samples) timer->cancel();
  });
  for (const auto& node : {source, filter, sink}) executor->add_node(node);
  executor->spin();
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  rclcpp::init(argc, argv);
  const int code = run(argv[1], std::atoi(argv[2]), argc > 3 && std::strcmp(argv[3], "intra_process") == 0);
  rclcpp::shutdown();
  return code;
}
